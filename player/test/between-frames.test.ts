/** Motion between frames, in slow motion and in a headset; a pause shows an exact frame. */

import assert from "node:assert/strict";
import { browserTest, PlayerPage } from "./browser.js";
import { makeEmulatorScript, SIZE } from "./emulator.js";
import type { Pixels } from "./png.js";

const SLOW_SPEED = 0.002; // a frame lasts 17 seconds

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

browserTest("slow motion shows pictures between two frames, and a pause shows the frame", async () => {
  await using page = await PlayerPage.open({ attributes: `speed="${SLOW_SPEED}"` });
  await page.waitUntil((player) => player.frame === 0);
  for (const frame of [5, 17]) { // both have births
    const after = await showFrame(page, frame);
    const before = await showFrame(page, frame - 1);
    await page.run((player) => player.play());
    await page.page.waitForFunction(`document.querySelector("quarc-player").frame === ${frame}`);
    const picture = await takeScenePixels(page);
    const [fromBefore, toAfter, step] = [[before, picture], [picture, after], [before, after]].map(([first, second]) =>
      measureDifference(first!, second!),
    ) as [number, number, number];
    assert.ok(Math.max(fromBefore, toAfter) < 1.5 * step, `frame ${frame}: ${fromBefore}, ${toAfter}, ${step}`);
    assert.ok(toAfter > 0.1 * step, `frame ${frame} did not move`);
    await page.run((player) => player.pause());
    const pausedPicture = await takeScenePixels(page);
    // Gaussians at the same depth may be drawn in another order.
    assert.ok(pausedPicture.every((value, index) => Math.abs(value - (after[index] ?? 0)) <= 2), `frame ${frame}, paused`);
  }
});

/** Lists the values of the shader's uniform `progress` that are below 1, when it draws between two frames. */
const RECORD_PROGRESS = `
  window.between = [];
  const { getUniformLocation, uniform1f } = WebGL2RenderingContext.prototype;
  const locations = new Set();
  WebGL2RenderingContext.prototype.getUniformLocation = function (program, name) {
    const location = getUniformLocation.call(this, program, name);
    if (name === "progress") locations.add(location);
    return location;
  };
  WebGL2RenderingContext.prototype.uniform1f = function (location, value) {
    if (locations.has(location) && value < 1) between.push(value);
    uniform1f.call(this, location, value);
  };`;

browserTest("at normal speed, only a headset shows pictures between two frames", async () => {
  await using page = await PlayerPage.open({ ...SIZE, attributes: "loop", initScript: makeEmulatorScript() + RECORD_PROGRESS });
  await page.waitUntil((player) => player.frame === 0);
  await page.run((player) => player.play());
  await page.waitUntil((player) => (player.frame ?? 0) > 3);
  assert.equal(await page.page.evaluate("between.length"), 0);
  await page.run(({ player }) => player?.enterHeadset());
  await page.page.waitForFunction("between.some((progress) => progress > 0)");
});
