/** Pictures between two frames, in slow motion and in a headset; a pause shows an exact frame. */

import assert from "node:assert/strict";
import { browserTest, PlayerPage } from "./browser.js";
import { makeEmulatorScript, SIZE } from "./emulator.js";
import type { Pixels } from "./png.js";

declare let between: number[]; // on the page

const SLOW_SPEED = 0.0005; // a frame lasts a minute

/**
 * Lists the values of the shader's uniform `progress` that are below 1, when it draws between two frames. Instead of
 * them, it uses `forcedProgress` unless that is null.
 */
const WATCH_PROGRESS = `
  window.between = [];
  window.forcedProgress = null;
  const { getUniformLocation, uniform1f } = WebGL2RenderingContext.prototype;
  const locations = new Set();
  WebGL2RenderingContext.prototype.getUniformLocation = function (program, name) {
    const location = getUniformLocation.call(this, program, name);
    if (name === "progress") locations.add(location);
    return location;
  };
  WebGL2RenderingContext.prototype.uniform1f = function (location, value) {
    const isBetween = locations.has(location) && value < 1;
    if (isBetween) between.push(value);
    uniform1f.call(this, location, isBetween ? (forcedProgress ?? value) : value);
  };`;

/** Take a picture of the scene, without the timeline and the buttons below it. */
async function takeScenePixels(page: PlayerPage): Promise<number[]> {
  const { width, height, pixelAt }: Pixels = await page.takeScreenshot();
  const pixels = [];
  for (let y = 0; y < height / 2; y++) for (let x = 0; x < width; x++) pixels.push(...pixelAt(x, y));
  return pixels;
}

async function takeFrame(page: PlayerPage, frame: number): Promise<number[]> {
  await page.setFrame(frame);
  return takeScenePixels(page);
}

/** Take a picture between the previous frame (0) and the current frame (1). */
async function takePictureBetween(page: PlayerPage, progress: number): Promise<number[]> {
  await page.page.evaluate(`between = []; forcedProgress = ${progress}`);
  await page.page.waitForFunction("between.length > 2");
  return takeScenePixels(page);
}

function measureDifference(first: readonly number[], second: readonly number[]): number {
  return first.reduce((sum, value, index) => sum + Math.abs(value - (second[index] ?? 0)), 0);
}

browserTest("slow motion shows pictures between two frames, and a pause shows the frame", async () => {
  await using page = await PlayerPage.open({ attributes: `speed="${SLOW_SPEED}"`, initScript: WATCH_PROGRESS });
  await page.waitUntil((player) => player.frame === 0);
  for (const frame of [5, 17]) { // both have births
    const after = await takeFrame(page, frame);
    const before = await takeFrame(page, frame - 1);
    const change = measureDifference(before, after);
    await page.run((player) => player.play());
    await page.page.waitForFunction(`document.querySelector("quarc-player").frame === ${frame}`);
    for (const progress of [0, 0.5, 0.999]) {
      const picture = await takePictureBetween(page, progress);
      const shares = [before, after].map((end) => measureDifference(picture, end) / change) as [number, number];
      const message = `frame ${frame}, ${progress}: ${shares.join(", ")}`;
      assert.ok(Math.abs(shares[0] - progress) < 0.15 && Math.abs(shares[1] - (1 - progress)) < 0.15, message);
    }
    await page.run((player) => player.pause());
    const pausedPicture = await takeScenePixels(page);
    // Gaussians at the same depth may be drawn in another order.
    assert.ok(pausedPicture.every((value, index) => Math.abs(value - (after[index] ?? 0)) <= 2), `frame ${frame}, paused`);
  }
});

browserTest("in slow motion, a canonical frame is shown at once, because its Gaussians are others", async () => {
  await using page = await PlayerPage.open({ attributes: `speed="${SLOW_SPEED}"`, initScript: WATCH_PROGRESS });
  await page.waitUntil(({ info }) => (info?.canonicalFrames.length ?? 0) > 1);
  const isBetween = await page.run(async (player) => {
    const canonicalFrame = player.info!.canonicalFrames[1]!;
    const states: boolean[] = [];
    for (const frame of [canonicalFrame, canonicalFrame + 1]) {
      await player.setFrame(frame - 1);
      const shown = new Promise((resolve) => player.addEventListener("frame", resolve, { once: true }));
      player.play();
      await shown;
      between = [];
      for (let count = 0; count < 3; count++) await new Promise((resolve) => requestAnimationFrame(resolve));
      states.push(between.length > 0);
      player.pause();
    }
    return states;
  });
  assert.deepEqual(isBetween, [false, true]);
});

browserTest("at normal speed, only a headset shows pictures between two frames", async () => {
  await using page = await PlayerPage.open({ ...SIZE, attributes: "loop", initScript: makeEmulatorScript() + WATCH_PROGRESS });
  await page.waitUntil((player) => player.frame === 0);
  await page.run((player) => player.play());
  await page.waitUntil((player) => (player.frame ?? 0) > 3);
  assert.equal(await page.page.evaluate("between.length"), 0);
  await page.run(({ player }) => player?.enterHeadset());
  await page.page.waitForFunction("between.some((progress) => progress > 0)");
});
