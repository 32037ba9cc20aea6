/** Pages with a Content-Security-Policy. */

import assert from "node:assert/strict";
import { browserTest, PlayerPage } from "./browser.js";
import type { PlayerFault } from "../src/protocol.js";
import type { StreamError } from "../src/stream-error.js";

browserTest("a Content-Security-Policy that forbids the decoder is named in the error", async () => {
  for (const [policy, message] of [
    ["script-src 'self' 'wasm-unsafe-eval'; worker-src 'none'", /a Content-Security-Policy must allow worker-src blob:/],
    ["script-src 'self'; worker-src blob:", /the decoder cannot be loaded: CompileError: .*Content Security Policy/i],
  ] as const) {
    const html = `<!doctype html><meta http-equiv="Content-Security-Policy" content="${policy}">`;
    await using page = await PlayerPage.open({ files: { "/": html }, expectedErrors: /Content Security Policy/ });
    const faults = await page.page.evaluate(async () => {
      const { Player, readFrames } = await import(`${location.origin}/quarc-player.js`);
      const source = { url: "stream.quarc" };
      const player = new Player(document.body.appendChild(document.createElement("canvas")));
      const failed = new Promise<PlayerFault>((resolve) => {
        player.addEventListener("error", ({ detail }: CustomEvent<PlayerFault>) => {
          if (!detail.message.includes("sort worker")) resolve(detail);
        });
      });
      player.open(source);
      return [await failed, await readFrames(source).next().catch(({ fault }: StreamError) => fault)];
    });
    for (const fault of faults) {
      assert.equal(fault.kind, "limit");
      assert.match(fault.message, message);
    }
  }
});

browserTest("the Content-Security-Policy that README.md names allows everything that the component needs", async () => {
  const policy = "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; worker-src blob:; style-src 'unsafe-inline'";
  const html = `<!doctype html><meta http-equiv="Content-Security-Policy" content="${policy}">
<script type="module" src="quarc-player.js"></script><quarc-player src="stream.quarc"></quarc-player>`;
  await using page = await PlayerPage.open({ files: { "/": html } }); // fails if the console shows an error
  await page.run(async (player) => { // `waitUntil` needs 'unsafe-eval'
    if (player.frame === null) await new Promise((resolve) => player.addEventListener("frame", resolve, { once: true }));
  });
});
