/** A stream as large and as sparse as that of the real capture plays in real time. */

import assert from "node:assert/strict";
import { availableParallelism, loadavg } from "node:os";
import { measureThreads } from "../bench/threads.mjs";
import { browserTest, launch, PlayerPage } from "./browser.js";
import type { Player } from "../src/player.js";
import { makeMovingStream, skipReference } from "./reference.js";

const FRAMES = 61;
const FRAME_MS = 1000 / 30;
const JOB = `11_600, anchors_per=6, births=20, frames=${FRAMES}, updated=0.02, sparse=True`; // 2787 anchors
const ATTEMPTS = 3;

interface Opened {
  player: Player;
}

/** A page with a player whose canvas has one pixel: without a graphics card, drawing takes longest. */
async function openStream(): Promise<PlayerPage> {
  const page = await PlayerPage.open({ stream: makeMovingStream(JOB), attributes: null });
  await page.page.evaluate(async () => {
    const { Player } = await import(`${location.origin}/quarc-player.js`);
    const canvas = document.body.appendChild(document.createElement("canvas"));
    canvas.style.cssText = "width: 1px; height: 1px";
    const player = ((globalThis as unknown as Opened).player = new Player(canvas, { controls: false }));
    await player.open({ url: `${location.origin}/stream.quarc` });
    while (player.statistics?.bufferedFrames !== 12) await new Promise((wake) => setTimeout(wake, 1));
  });
  return page;
}

/** Step to the next frame, and wait until the same number of frames is decoded ahead. Runs on the page. */
async function step(): Promise<number | null> {
  const { player } = globalThis as unknown as Opened;
  const frame = await player.step();
  const ahead = Math.min(12, (player.endFrame ?? Infinity) - 1 - (frame ?? 0));
  while ((player.statistics?.bufferedFrames ?? 0) < ahead) await new Promise((wake) => setTimeout(wake, 1));
  return frame;
}

/** Play from the first frame to the end; return the frames that followed it and how many were late. Runs on the page. */
async function play(): Promise<{ frames: number[]; late: number }> {
  const { player } = globalThis as unknown as Opened;
  const countLate = (): number => player.statistics?.lateFrames ?? NaN;
  await player.seek(0);
  while (player.statistics?.bufferedFrames !== 12) await new Promise((wake) => setTimeout(wake, 1));
  const before = countLate();
  return new Promise((resolve) => {
    const frames: number[] = [];
    player.addEventListener("frame", ({ detail }) => frames.push(detail.frame));
    player.addEventListener("ended", () => resolve({ frames, late: countLate() - before }));
    player.play();
  });
}

// Decoding, sorting and uploading run in three threads, which in the worst case share one core.
browserTest("every frame takes less processor time than its duration", async (context) => {
  if (skipReference) return context.skip(skipReference);
  await using page = await openStream();
  const browser = await launch();
  const spent: number[] = [];
  for (let frame = 1; frame < FRAMES; frame++) {
    const before = await measureThreads(browser);
    assert.equal(await page.page.evaluate(step), frame);
    const after = await measureThreads(browser);
    spent.push(after.reduce((sum, ms, thread) => sum + ms - (before[thread] ?? 0), 0));
  }
  const mean = spent.reduce((sum, ms) => sum + ms, 0) / spent.length;
  context.diagnostic(`${mean.toFixed(1)} ms of processor time per frame, at most ${Math.max(...spent).toFixed(1)}`);
  assert.ok(Math.max(...spent) < FRAME_MS, spent.map((ms) => ms.toFixed(1)).join(" "));
});

browserTest("every frame is shown, and on a machine with time to spare none is late", async (context) => {
  if (skipReference) return context.skip(skipReference);
  const [load = 0] = loadavg();
  const cores = availableParallelism();
  const isBusy = load > cores;
  const counts: number[] = [];
  // Without a graphics card, drawing stops once for some seconds after a page's first frames, however few pixels
  // there are. So all attempts are on one page.
  await using page = await openStream();
  while (counts.at(-1) !== 0 && counts.length < (isBusy ? 1 : ATTEMPTS)) {
    const { frames, late } = await page.page.evaluate(play);
    assert.deepEqual(frames, Array.from({ length: FRAMES - 1 }, (_, at) => at + 1));
    counts.push(late);
  }
  context.diagnostic(`late frames: ${counts.join(", ")}; ${load.toFixed(1)} processes on ${cores} cores`);
  assert.ok(isBusy || counts.includes(0), "frames are late");
});
