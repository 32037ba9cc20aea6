/** An emulated headset (IWER) for browser tests. */

import { readFileSync } from "node:fs";

const START = `
  window.headset = new IWER.XRDevice(IWER.metaQuest3);
  headset.installRuntime({ forceInstall: true });
  headset.stereoEnabled = true;
  headset.ipd = 0.2;`;

/** Return the script that emulates a headset on a page; it must run before the page's own scripts. */
export function makeEmulatorScript(): string {
  return readFileSync(new URL("../node_modules/iwer/build/iwer.min.js", import.meta.url), "utf8") + START;
}

/** Size of pages with a headset: software draws small pictures faster. */
export const SIZE = { width: 320, height: 240 };
