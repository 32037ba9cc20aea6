/**
 * Measures decoding: node bench/decode.mjs FILE [FRAMES], after npm run build.
 *
 * Processor time of decoding frames to packets; the first frame is reported separately.
 */

import { readFileSync } from "node:fs";
import { readFrames } from "../dist/quarc-decode.js";

const [path, most = "Infinity"] = process.argv.slice(2);
if (path === undefined) {
  console.error("usage: node bench/decode.mjs FILE [FRAMES]");
  process.exit(2);
}

const milliseconds = () => {
  const { user, system } = process.cpuUsage();
  return (user + system) / 1000;
};

const times = [];
const bytes = new Uint8Array(readFileSync(path)).buffer;
let [begun, gaussians, moved] = [milliseconds(), 0, 0];
for await (const packet of readFrames({ bytes })) {
  const now = milliseconds();
  times.push(now - begun);
  begun = now;
  gaussians = packet.count;
  moved += packet.isFull ? 0 : packet.movedSlots.length;
  if (times.length === Number(most)) break;
}
const [first = 0, ...others] = times;
const mean = others.reduce((sum, time) => sum + time, 0) / others.length;
console.log(
  `${times.length} frames of ${gaussians} Gaussians, ${Math.round(moved / others.length)} of them moved: ` +
    `first ${first.toFixed(0)} ms, then ${mean.toFixed(1)} ms, ${(1000 / mean).toFixed(1)} frames per second`,
);
