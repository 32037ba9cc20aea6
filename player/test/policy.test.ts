/** Pages with a Content-Security-Policy. */

import assert from "node:assert/strict";
import { KEEP_AUDIO, makeWav } from "./audio-file.js";
import { browserTest, PlayerPage } from "./browser.js";
import type { PlayerFault } from "../src/protocol.js";
import type { StreamError } from "../src/stream-error.js";

declare const audioElement: HTMLAudioElement;

browserTest("a Content-Security-Policy that forbids the decoder is named in the error", async () => {
  for (const [policy, message] of [
    ["script-src 'self' 'wasm-unsafe-eval'; worker-src 'none'", /a Content-Security-Policy must allow worker-src blob:/],
    ["script-src 'self'; worker-src blob:", /the decoder cannot be loaded: CompileError: .*Content Security Policy/i],
  ] as const) {
    const html = `<!doctype html><meta http-equiv="Content-Security-Policy" content="${policy}">`;
    await using page = await PlayerPage.open({ files: { "/": html }, expectedErrors: /Content Security Policy/ });
    const { faults, isWaiting } = await page.page.evaluate(async () => {
      const { Player, readFrames } = await import(`${location.origin}/quarc-player.js`);
      const source = { url: "stream.quarc" };
      const player = new Player(document.body.appendChild(document.createElement("canvas")));
      const failed = new Promise<PlayerFault>((resolve) => {
        player.addEventListener("error", ({ detail }: CustomEvent<PlayerFault>) => {
          if (!detail.message.includes("sort worker")) resolve(detail);
        });
      });
      player.open(source);
      await failed;
      const again = await player.open(source).catch(({ fault }: StreamError) => fault); // a further stream fails, too
      const faults = [await failed, again, await readFrames(source).next().catch(({ fault }: StreamError) => fault)];
      return { faults, isWaiting: player.isWaiting };
    });
    for (const fault of faults) {
      assert.equal(fault.kind, "limit");
      assert.match(fault.message, message);
    }
    assert.equal(isWaiting, false);
  }
});

browserTest("the Content-Security-Policy that README.md names allows everything that the component needs", async () => {
  const policy = "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; worker-src blob:; media-src 'self' blob:";
  const html = `<!doctype html><meta http-equiv="Content-Security-Policy" content="${policy}">
<script type="module" src="quarc-player.js"></script><quarc-player src="stream.quarc" audio="a.wav"></quarc-player>`;
  const files = { "/": html, "/a.wav": makeWav(1) };
  // Without range requests, the audio becomes a blob. The page fails if the console shows an error.
  await using page = await PlayerPage.open({ files, supportsRanges: false, initScript: KEEP_AUDIO });
  await page.run(async (player) => { // `waitUntil` needs 'unsafe-eval'
    if (player.frame === null) await new Promise((resolve) => player.addEventListener("frame", resolve, { once: true }));
    const isBlob = (): boolean => audioElement.src.startsWith("blob:") && audioElement.readyState > 0;
    while (!isBlob()) await new Promise((resolve) => setTimeout(resolve, 20));
  });
  assert.equal(await page.run((player) => getComputedStyle(player).backgroundColor), "rgb(13, 15, 18)");
});

browserTest("pages that require Trusted Types can allow the player's policy", async () => {
  const policy = "require-trusted-types-for 'script'; trusted-types quarc-player";
  const html = `<!doctype html><meta http-equiv="Content-Security-Policy" content="${policy}">
<script type="module" src="quarc-player.js"></script><quarc-player src="stream.quarc"></quarc-player>`;
  await using page = await PlayerPage.open({ files: { "/": html } }); // fails if the console shows an error
  await page.run(async (player) => {
    if (player.frame === null) await new Promise((resolve) => player.addEventListener("frame", resolve, { once: true }));
  });
  assert.equal(await page.run((player) => player.shadowRoot?.querySelectorAll("button svg").length !== 0), true);
});

browserTest("an element keeps its style when it is moved to another window", async () => {
  await using page = await PlayerPage.open();
  const color = await page.run((player) => {
    const { contentDocument, contentWindow } = document.body.appendChild(document.createElement("iframe"));
    contentDocument?.body.append(player);
    return contentWindow?.getComputedStyle(player).backgroundColor;
  });
  assert.equal(color, "rgb(13, 15, 18)");
});
