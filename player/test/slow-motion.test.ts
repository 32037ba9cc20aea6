/** Slow motion: Gaussians move from frame to frame, and the frames of a stream that is paused are exact. */

import assert from "node:assert/strict";
import { browserTest, PlayerPage } from "./browser.js";
import type { Pixels } from "./png.js";

const [FIRST_FRAME, LAST_FRAME] = [4, 9]; // no canonical frame is between them
const SLOW_SPEED = 0.03; // a frame lasts about a second

/** Take a picture of the scene, without the buttons below it. */
async function takeScenePixels(page: PlayerPage): Promise<number[]> {
  const { width, height, pixelAt }: Pixels = await page.takeScreenshot();
  const pixels = [];
  for (let y = 0; y < height / 2; y++) for (let x = 0; x < width; x++) pixels.push(...pixelAt(x, y));
  return pixels;
}

function measureDifference(first: readonly number[], second: readonly number[]): number {
  return first.reduce((sum, value, index) => sum + Math.abs(value - (second[index] ?? 0)), 0);
}

const showFrame = async (page: PlayerPage, frame: number): Promise<number[]> => {
  await page.setFrame(frame);
  return takeScenePixels(page);
};

browserTest("in slow motion, pictures between two frames are shown", async () => {
  await using page = await PlayerPage.open({ attributes: `speed="${SLOW_SPEED}"` });
  await page.waitUntil((player) => player.frame === 0);
  const exactPictures = new Map<number, number[]>();
  for (let frame = FIRST_FRAME; frame <= LAST_FRAME; frame++) exactPictures.set(frame, await showFrame(page, frame));
  await page.setFrame(FIRST_FRAME);
  await page.run((player) => player.play());
  let betweenCount = 0;
  for (let frame = FIRST_FRAME + 1; frame <= LAST_FRAME; frame++) {
    await page.page.waitForFunction(`document.querySelector("quarc-player").frame === ${frame}`);
    const picture = await takeScenePixels(page);
    if ((await page.run((player) => player.frame)) !== frame) continue; // the screenshot took too long
    const [before = [], after = []] = [exactPictures.get(frame - 1), exactPictures.get(frame)];
    const step = measureDifference(before, after);
    const [fromBefore, toAfter] = [measureDifference(before, picture), measureDifference(picture, after)];
    assert.ok(Math.max(fromBefore, toAfter) < 1.5 * step, `frame ${frame}: ${fromBefore}, ${toAfter}, ${step}`);
    if (toAfter > 0.1 * step) betweenCount += 1;
  }
  assert.ok(betweenCount > 0, "all pictures were exact");
});

browserTest("a pause in slow motion shows the exact frame", async () => {
  await using page = await PlayerPage.open({ attributes: `speed="${SLOW_SPEED}"` });
  await page.waitUntil((player) => player.frame === 0);
  await page.run(async (player) => {
    const shown = new Promise((resolve) => player.addEventListener("frame", resolve, { once: true }));
    player.play();
    await shown;
    player.pause();
  });
  const frame = await page.run((player) => player.frame ?? -1);
  assert.ok(frame > 0);
  const picture = await takeScenePixels(page);
  await page.setFrame(0);
  const exactPicture = await showFrame(page, frame);
  assert.ok(picture.every((value, index) => Math.abs(value - (exactPicture[index] ?? 0)) <= 2));
});
