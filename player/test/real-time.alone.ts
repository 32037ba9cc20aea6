/**
 * A stream with the size and sparsity of that of a real capture plays in real time. This file is run after all others
 * (package.json), so that no other test takes processor time.
 */

import assert from "node:assert/strict";
import { cpus } from "node:os";
import { setTimeout as sleep } from "node:timers/promises";
import { measureThreads } from "../bench/threads.mjs";
import { browserTest, launch, PlayerPage } from "./browser.js";
import type { Player } from "../src/player.js";
import { makeMovingStream, referenceSkipReason } from "./reference.js";

const FRAMES = 61;
const FRAME_MS = 1000 / 30;
const STREAM_JOB = `11_600, gaussians_per_anchor=6, births=20, frames=${FRAMES}, updated_share=0.02, sparse=True`; // 2787 anchors
const MAX_ATTEMPTS = 3;
const MIN_IDLE_CORES = 0.5; // of a machine that is not busy

interface PlayerGlobal {
  player: Player;
}

/** Open a page with a player whose canvas has one pixel, because drawing is slow without a graphics card. */
async function openStream(): Promise<PlayerPage> {
  const page = await PlayerPage.open({ stream: makeMovingStream(STREAM_JOB), attributes: null });
  await page.page.evaluate(async () => {
    const { Player } = await import(`${location.origin}/quarc-player.js`);
    const canvas = document.body.appendChild(document.createElement("canvas"));
    canvas.style.cssText = "width: 1px; height: 1px";
    const player = ((globalThis as unknown as PlayerGlobal).player = new Player(canvas, { controls: false }));
    await player.open({ url: `${location.origin}/stream.quarc` });
    while (player.statistics?.bufferedFrames !== 12) await new Promise((wake) => setTimeout(wake, 1));
  });
  return page;
}

/** Step to the next frame, and wait until the buffer of decoded frames is full again. Runs on the page. */
async function step(): Promise<number | null> {
  const { player } = globalThis as unknown as PlayerGlobal;
  const frame = await player.step();
  const expectedBuffer = Math.min(12, (player.endFrame ?? Infinity) - 1 - (frame ?? 0));
  while ((player.statistics?.bufferedFrames ?? 0) < expectedBuffer) await new Promise((wake) => setTimeout(wake, 1));
  return frame;
}

/** Play from the first frame to the end; return the shown frames and the number of late frames. Runs on the page. */
async function play(): Promise<{ frames: number[]; lateFrames: number }> {
  const { player } = globalThis as unknown as PlayerGlobal;
  const readLateFrames = (): number => player.statistics?.lateFrames ?? NaN;
  await player.seek(0);
  while (player.statistics?.bufferedFrames !== 12) await new Promise((wake) => setTimeout(wake, 1));
  const lateBefore = readLateFrames();
  return new Promise((resolve) => {
    const frames: number[] = [];
    player.addEventListener("frame", ({ detail }) => frames.push(detail.frame));
    player.addEventListener("ended", () => resolve({ frames, lateFrames: readLateFrames() - lateBefore }));
    player.play();
  });
}

/** Measure for a second how many processor cores are idle on average. */
async function measureIdleCores(): Promise<number> {
  const sumIdleMs = (): number => cpus().reduce((sum, { times }) => sum + times.idle, 0);
  const [idleBefore, timeBefore] = [sumIdleMs(), performance.now()];
  await sleep(1000);
  return (sumIdleMs() - idleBefore) / (performance.now() - timeBefore);
}

// Measured before the tests, whose own drawing keeps a machine without a graphics card busy.
const idleCores = await measureIdleCores();

// Decoding, sorting and uploading run in three threads, which may have to share one core.
browserTest("frames take less processor time than their duration on average", async (context) => {
  if (referenceSkipReason) return context.skip(referenceSkipReason);
  await using page = await openStream();
  const browser = await launch();
  const frameTimes: number[] = [];
  for (let frame = 1; frame < FRAMES; frame++) {
    const timesBefore = await measureThreads(browser);
    assert.equal(await page.page.evaluate(step), frame);
    const timesAfter = await measureThreads(browser);
    frameTimes.push(timesAfter.reduce((sum, ms, thread) => sum + ms - (timesBefore[thread] ?? 0), 0));
  }
  const mean = frameTimes.reduce((sum, ms) => sum + ms, 0) / frameTimes.length;
  context.diagnostic(`${mean.toFixed(1)} ms of processor time per frame, at most ${Math.max(...frameTimes).toFixed(1)}`);
  // Not the maximum: buffered frames hide a single slow frame, and machines differ.
  assert.ok(mean < FRAME_MS, frameTimes.map((ms) => ms.toFixed(1)).join(" "));
});

browserTest("every frame is shown, and no frame is late on an idle machine", async (context) => {
  if (referenceSkipReason) return context.skip(referenceSkipReason);
  const isBusy = idleCores < MIN_IDLE_CORES;
  const lateCounts: number[] = [];
  // Without a graphics card, the first picture of a page takes longer, because its shaders are compiled. So all attempts
  // use the same page.
  await using page = await openStream();
  while (lateCounts.at(-1) !== 0 && lateCounts.length < (isBusy ? 1 : MAX_ATTEMPTS)) {
    const { frames, lateFrames } = await page.page.evaluate(play);
    assert.deepEqual(frames, Array.from({ length: FRAMES - 1 }, (_, index) => index + 1));
    lateCounts.push(lateFrames);
  }
  context.diagnostic(`late frames: ${lateCounts.join(", ")}; ${idleCores.toFixed(1)} of ${cpus().length} cores were idle`);
  assert.ok(isBusy || lateCounts.includes(0), "frames were late in every attempt");
});
