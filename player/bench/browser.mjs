/**
 * Measures playback in Chromium, and the time to the first picture (Linux):
 *
 *     node bench/browser.mjs FILE [FRAMES]     after npm run build
 *
 * Prints frames per second of decoding, sorting and uploading, from the processor time of the decode worker, of the
 * sort worker and of the page, which also runs the player and issues the draw calls; the work of a graphics card is not
 * included. Then the number of late frames in real time, and the time to the first picture and the first frame over a
 * connection of 2 Mbit/s. $QUARC_CHROMIUM names the browser.
 */

import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import { chromium } from "playwright-core";
import { measureThreads } from "./threads.mjs";

const [path, most = "Infinity"] = process.argv.slice(2);
if (path === undefined) {
  console.error("usage: node bench/browser.mjs FILE [FRAMES]");
  process.exit(2);
}

const BITS_PER_SECOND = 2e6;
const PIECE_BYTES = 4096;
const stream = readFileSync(path);
const script = readFileSync(new URL("../dist/quarc-player.js", import.meta.url));
let bitsPerSecond = Infinity;

async function send(response, bytes) {
  const begun = performance.now();
  for (let place = 0; place < bytes.length && !response.destroyed; place += PIECE_BYTES) {
    response.write(bytes.subarray(place, place + PIECE_BYTES));
    const early = begun + (8000 * (place + PIECE_BYTES)) / bitsPerSecond - performance.now();
    if (early > 0) await new Promise((resolve) => setTimeout(resolve, early));
  }
  response.end();
}

const server = createServer((request, response) => {
  const range = /^bytes=(\d+)-/.exec(request.headers.range ?? "");
  if (request.url === "/stream.quarc") {
    const begin = Number(range?.[1] ?? 0);
    const size = stream.length;
    response.writeHead(206, { "Content-Range": `bytes ${begin}-${size - 1}/${size}`, "Content-Length": size - begin });
    void send(response, stream.subarray(begin));
  } else if (request.url === "/quarc-player.js") {
    response.writeHead(200, { "Content-Type": "text/javascript" }).end(script);
  } else response.writeHead(200, { "Content-Type": "text/html" }).end("<!doctype html><canvas width=160 height=120>");
});
await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
const browser = await chromium.launch({
  executablePath: process.env.QUARC_CHROMIUM ?? "/usr/bin/chromium-headless-shell",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
const open = async () => {
  const page = await browser.newPage({ viewport: { width: 160, height: 120 } });
  await page.goto(`http://127.0.0.1:${server.address().port}/`);
  return page;
};

/** Make a player and wait for its first frame. Runs on the page. */
async function begin() {
  const { Player } = await import("/quarc-player.js");
  globalThis.player = new Player(document.querySelector("canvas"), { controls: false });
  await player.open({ url: `${location.origin}/stream.quarc` });
  while (player.endFrame === null) await new Promise((resolve) => setTimeout(resolve, 20));
  return player.statistics;
}

/** Step through the frames. Runs on the page. */
async function stepThrough(most) {
  let [frames, changed] = [0, 0];
  for (; frames < most && player.frame + 1 < player.endFrame; frames++) {
    const shown = new Promise((resolve) => player.addEventListener("frame", resolve, { once: true }));
    player.step(1);
    await shown;
    changed += player.statistics.changed / (player.endFrame - 1);
  }
  return { frames, changed };
}

/** Milliseconds from the script to the first picture, and to the first frame. Runs on the page. */
async function load() {
  const { Player } = await import("/quarc-player.js");
  const begun = performance.now();
  const player = new Player(document.querySelector("canvas"), { controls: false });
  let preview = null;
  player.addEventListener("preview", () => (preview ??= performance.now() - begun));
  await player.open({ url: `${location.origin}/stream.quarc` });
  const frame = performance.now() - begun;
  player.dispose();
  return { preview: preview ?? frame, frame };
}

/** Play in real time, and count late frames. Runs on the page. */
async function playThrough(most) {
  const { Player } = await import("/quarc-player.js");
  const player = new Player(document.querySelector("canvas"), { controls: false });
  await player.open({ url: `${location.origin}/stream.quarc` });
  let shown = 0;
  const ended = new Promise((resolve) => {
    player.addEventListener("frame", () => ++shown >= most && resolve());
    player.addEventListener("ended", resolve);
  });
  player.play();
  await ended;
  const late = player.statistics.lateFrames;
  player.dispose();
  return { shown, late };
}

const page = await open();
const { gaussians, decodeMs } = await page.evaluate(begin);
const before = await measureThreads(browser);
const { frames, changed } = await page.evaluate(stepThrough, Number(most));
const spent = (await measureThreads(browser)).map((ms, thread) => (ms - before[thread]) / frames);
await page.close();
const rate = (ms) => `${ms.toFixed(1)} ms, ${(1000 / ms).toFixed(0)} per second`;
console.log(`${gaussians} Gaussians, ${changed.toFixed(0)} change per frame, ${frames} frames; the first decodes in ${decodeMs.toFixed(0)} ms`);
const [upload, sort, decode] = spent;
for (const [name, ms] of Object.entries({ decode, sort, upload, together: decode + sort + upload })) {
  console.log(`${name.padEnd(9)} ${rate(ms)}`);
}
const { shown, late } = await (await open()).evaluate(playThrough, Number(most));
console.log(`played: ${shown} frames shown, ${late} of them late`);
bitsPerSecond = BITS_PER_SECOND;
const { preview, frame } = await (await open()).evaluate(load);
console.log(`at 2 Mbit/s: first picture after ${preview.toFixed(0)} ms, first frame after ${frame.toFixed(0)} ms`);
await browser.close();
server.closeAllConnections();
server.close();
