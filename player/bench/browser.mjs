/**
 * Measures playback in Chromium, and the time to the first picture (Linux):
 *
 *     node bench/browser.mjs FILE [FRAMES]     after npm run build
 *
 * The frame rates of decoding, sorting and uploading are computed from the processor time of the decode worker, the sort
 * worker and the page. The decode worker is ahead of the page: the frames that it has decoded before the measurement are
 * not counted, so a stream needs more than 13 frames. The time of the page includes the player and its draw calls, but
 * not the work of a graphics card. The program also prints the number of late frames in real time, and the time to the first picture and to the first
 * frame over a connection of 2 Mbit/s. $QUARC_CHROMIUM names the browser.
 */

import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import { chromium } from "playwright-core";
import { measureThreads } from "./threads.mjs";

const [path, maxFrames = "Infinity"] = process.argv.slice(2);
if (path === undefined) {
  console.error("usage: node bench/browser.mjs FILE [FRAMES]");
  process.exit(2);
}

const BITS_PER_SECOND = 2e6;
const PIECE_BYTES = 4096;
const stream = readFileSync(path);
const playerScript = readFileSync(new URL("../dist/quarc-player.js", import.meta.url));
let bitsPerSecond = Infinity;

async function send(response, bytes) {
  const startTime = performance.now();
  for (let offset = 0; offset < bytes.length && !response.destroyed; offset += PIECE_BYTES) {
    response.write(bytes.subarray(offset, offset + PIECE_BYTES));
    const waitMs = startTime + (8000 * (offset + PIECE_BYTES)) / bitsPerSecond - performance.now();
    if (waitMs > 0) await new Promise((resolve) => setTimeout(resolve, waitMs));
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
    response.writeHead(200, { "Content-Type": "text/javascript" }).end(playerScript);
  } else response.writeHead(200, { "Content-Type": "text/html" }).end("<!doctype html><canvas width=160 height=120>");
});
await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
const browser = await chromium.launch({
  executablePath: process.env.QUARC_CHROMIUM ?? "/usr/bin/chromium-headless-shell",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
const openPage = async () => {
  const page = await browser.newPage({ viewport: { width: 160, height: 120 } });
  await page.goto(`http://127.0.0.1:${server.address().port}/`);
  return page;
};

/** Create a player, wait until its buffer is full, and return the statistics of its first frame. Runs on the page. */
async function openPlayer() {
  const { Player } = await import("/quarc-player.js");
  globalThis.player = new Player(document.querySelector("canvas"), { controls: false });
  globalThis.decoded = 0;
  player.onDecoded(() => (decoded += 1));
  globalThis.waitForBuffer = async () => {
    for (let before = -1; before < decoded || player.endFrame === null; ) {
      before = decoded;
      await new Promise((resolve) => setTimeout(resolve, 500));
    }
  };
  await player.open({ url: `${location.origin}/stream.quarc` });
  await waitForBuffer();
  return player.statistics;
}

/** Step through the frames; return their number, that of decoded frames, and the changed Gaussians per frame. Runs on the page. */
async function stepThrough(maxFrames) {
  let [frames, changed, decodedBefore] = [0, 0, decoded];
  for (; frames < maxFrames && player.frame + 1 < player.endFrame; frames++) {
    const nextFrame = new Promise((resolve) => player.addEventListener("frame", resolve, { once: true }));
    player.step(1);
    await nextFrame;
    changed += player.statistics.changed;
  }
  await waitForBuffer();
  return { frames, decodedFrames: decoded - decodedBefore, changed: changed / frames };
}

/** Return the milliseconds from creating a player to the first picture and to the first frame. Runs on the page. */
async function measureLoading() {
  const { Player } = await import("/quarc-player.js");
  const startTime = performance.now();
  const player = new Player(document.querySelector("canvas"), { controls: false });
  let preview = null;
  player.addEventListener("preview", () => (preview ??= performance.now() - startTime));
  await player.open({ url: `${location.origin}/stream.quarc` });
  const frame = performance.now() - startTime;
  player.dispose();
  return { preview: preview ?? frame, frame };
}

/** Play in real time; count the shown frames and the late frames. Runs on the page. */
async function playThrough(maxFrames) {
  const { Player } = await import("/quarc-player.js");
  const player = new Player(document.querySelector("canvas"), { controls: false });
  await player.open({ url: `${location.origin}/stream.quarc` });
  let shownFrames = 0;
  const ended = new Promise((resolve) => {
    player.addEventListener("frame", () => ++shownFrames >= maxFrames && resolve());
    player.addEventListener("ended", resolve);
  });
  player.play();
  await ended;
  const lateFrames = player.statistics.lateFrames;
  player.dispose();
  return { shown: shownFrames, late: lateFrames };
}

const page = await openPage();
const { gaussians, decodeMs } = await page.evaluate(openPlayer);
const timesBefore = await measureThreads(browser);
const { frames, decodedFrames, changed } = await page.evaluate(stepThrough, Number(maxFrames));
const threadTimes = (await measureThreads(browser)).map((ms, thread) => ms - timesBefore[thread]);
await page.close();
const formatRate = (ms) => `${ms.toFixed(1)} ms, ${(1000 / ms).toFixed(0)} per second`;
console.log(`${gaussians} Gaussians, ${changed.toFixed(0)} change per frame, ${frames} frames; the first decodes in ${decodeMs.toFixed(0)} ms`);
const [upload, sort, decode] = [threadTimes[0] / frames, threadTimes[1] / frames, threadTimes[2] / decodedFrames];
for (const [name, ms] of Object.entries({ decode, sort, upload, together: decode + sort + upload })) {
  console.log(`${name.padEnd(9)} ${formatRate(ms)}`);
}
const { shown: shownFrames, late: lateFrames } = await (await openPage()).evaluate(playThrough, Number(maxFrames));
console.log(`played: ${shownFrames} frames shown, ${lateFrames} of them late`);
bitsPerSecond = BITS_PER_SECOND;
const { preview, frame } = await (await openPage()).evaluate(measureLoading);
console.log(`at 2 Mbit/s: first picture after ${preview.toFixed(0)} ms, first frame after ${frame.toFixed(0)} ms`);
await browser.close();
server.closeAllConnections();
server.close();
