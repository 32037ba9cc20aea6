/** The player's pictures match those of `quarc-ref render`, except for rounding. */

import assert from "node:assert/strict";
import type { TestContext } from "node:test";
import { browserTest, PlayerPage, type PlayerElement } from "./browser.js";
import { renderReference, referenceSkipReason } from "./reference.js";
import { readRoom, readVector } from "./server.js";

const MIN_DB = { float: 45, bytes: 40 } as const;

interface Comparison {
  readonly camera: string;
  readonly path: string;
  readonly format: "float" | "bytes";
  /** Distance by which the camera is moved ahead, world units. */
  readonly ahead?: number;
}

/** Return the PSNR between a PNG and the player's picture from a camera, of the same size. Runs on the page. */
async function computePsnr(player: PlayerElement, { camera, path, format, ahead = 0 }: Comparison): Promise<number> {
  const image = await createImageBitmap(await (await fetch(path)).blob());
  const eye = player.player!.cameras.find(({ name }) => name === camera)!;
  const [scaleX, scaleY] = [image.width / eye.width, image.height / eye.height];
  const size = { width: image.width, height: image.height };
  const lens = { fx: eye.fx * scaleX, fy: eye.fy * scaleY, cx: eye.cx * scaleX, cy: eye.cy * scaleY };
  const [x = 0, y = 0, z = 0] = eye.translation;
  const picture = await player.player!.takePicture({ ...eye, ...size, ...lens, translation: [x, y, z - ahead] }, format);
  const canvas = new OffscreenCanvas(image.width, image.height);
  const context = canvas.getContext("2d");
  context?.drawImage(image, 0, 0);
  const pixels = context?.getImageData(0, 0, image.width, image.height).data ?? [];
  let sum = 0;
  for (let value = 0; value < picture.length; value++) {
    const expectedValue = (pixels[4 * Math.floor(value / 3) + (value % 3)] ?? 0) / 255;
    sum += ((picture[value] ?? 0) - expectedValue) ** 2;
  }
  return 4 * image.width * image.height === pixels.length ? -10 * Math.log10(sum / picture.length) : 0;
}

browserTest("a picture has the size of its camera, and an invalid size is an error", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  const results = await page.run(async ({ player }) => {
    const camera = player!.cameras[0]!;
    const sizes = [[321, 77], [0, 120], [-160, 120], [160.5, 120], [160, NaN], [1e6, 1], [1, 2 ** 32], [160, 120]] as const;
    const results: (string | number)[] = [];
    for (const [width, height] of sizes) {
      const picture = player!.takePicture({ ...camera, width, height });
      results.push(await picture.then(({ length }) => length, (error: Error) => `${error.name}: ${error.message}`));
    }
    return results;
  });
  assert.deepEqual([results[0], results.at(-1)], [3 * 321 * 77, 3 * 160 * 120]);
  for (const result of results.slice(1, -1)) assert.match(String(result), /^RangeError: width and height are .* from 1 to \d+$/);
});

browserTest("a picture for which there is no graphics memory is an error", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  const result = await page.run(async (element) => {
    WebGL2RenderingContext.prototype.checkFramebufferStatus = () => WebGL2RenderingContext.FRAMEBUFFER_UNSUPPORTED;
    return element.takePicture(0).catch((error: Error) => `${error.name}: ${error.message}`);
  });
  assert.equal(result, "DrawingError: there is no graphics memory for 160 x 120 pixels");
});

/** Compare the player's pictures of some frames and cameras with those of quarc-ref. */
async function checkPictures(
  context: TestContext,
  stream: Uint8Array,
  cameras: string[],
  frames: number[],
  options: string[] = [],
): Promise<void> {
  const files: Record<string, Uint8Array> = {};
  for (const camera of cameras) {
    const pictures = renderReference(stream, camera, options);
    for (const frame of frames) files[`/${camera}-${frame}.png`] = pictures[frame]!;
  }
  await using page = await PlayerPage.open({ stream, files });
  await page.waitUntil((player) => player.frame === 0);
  for (const frame of frames) {
    await page.setFrame(frame);
    for (const camera of cameras) {
      for (const format of ["float", "bytes"] as const) {
        const psnr = await page.run(computePsnr, { camera, path: `${camera}-${frame}.png`, format });
        context.diagnostic(`frame ${frame}, ${camera}, ${format}: ${psnr.toFixed(1)} dB`);
        assert.ok(psnr >= MIN_DB[format], `frame ${frame}, ${camera}, ${format}: ${psnr} dB`);
      }
    }
  }
}

browserTest("pictures match those of quarc-ref render", async (context) => {
  if (referenceSkipReason) return context.skip(referenceSkipReason);
  await checkPictures(context, readRoom(), ["front", "upright"], [0, 11, 23]);
});

for (const width of [48, 400]) {
  browserTest(`pictures that are ${width} instead of 160 pixels wide match, too`, async (context) => {
    if (referenceSkipReason) return context.skip(referenceSkipReason);
    await checkPictures(context, readRoom(), ["front"], [0, 11], ["--width", String(width)]);
  });
}

browserTest("pictures of a camera that approaches the scene or leaves it match, too", async (context) => {
  if (referenceSkipReason) return context.skip(referenceSkipReason);
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  const { rotation, translation, height, fy } = await page.run(({ player }) => player!.cameras[0]!);
  const toWorld = (point: number[]): number[] =>
    [0, 1, 2].map((axis) => point.reduce((sum, value, row) => sum + rotation[3 * row + axis]! * (value - translation[row]!), 0));
  const fov = (360 / Math.PI) * Math.atan(height / 2 / fy);
  for (const ahead of [-1, 1]) {
    const [position, target] = [toWorld([0, 0, ahead]), toWorld([0, 0, ahead + 1])];
    const up = toWorld([0, -1, ahead]).map((value, axis) => value - position[axis]!);
    const keyframes = [{ time: 0, position, target, up, fov }];
    const path = JSON.stringify({ schema: "quarc-ref/camera-path/1", keyframes });
    const [png] = renderReference(readRoom(), "front", ["--frames", "0", "--width", "320"], path);
    page.server.setOptions({ files: { "/moved.png": png! } });
    const psnr = await page.run(computePsnr, { camera: "front", path: "moved.png", format: "float", ahead });
    context.diagnostic(`${ahead} ahead: ${psnr.toFixed(1)} dB`);
    assert.ok(psnr >= MIN_DB.float, `${ahead} ahead: ${psnr} dB`);
  }
});

browserTest("pictures of fewer Gaussians than the player draws at once match, too", async (context) => {
  if (referenceSkipReason) return context.skip(referenceSkipReason);
  await checkPictures(context, readVector("streams/cameras-and-metadata"), ["left"], [0]);
});

browserTest("a picture from the other side leaves the order on the screen as it is", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  const before = await page.takeScreenshot();
  await page.run(async ({ player }) => {
    const camera = player!.cameras[0]!;
    const rotation = camera.rotation.map((value, index) => (Math.floor(index / 3) === 1 ? value : -value)); // looks back
    await player!.takePicture({ ...camera, rotation });
    player!.camera = camera.name; // draws again
    for (let count = 0; count < 2; count++) await new Promise((resolve) => requestAnimationFrame(resolve));
  });
  const after = await page.takeScreenshot();
  for (let y = 0; y < before.height / 2; y += 3) {
    for (let x = 0; x < before.width; x += 3) assert.deepEqual(after.pixelAt(x, y), before.pixelAt(x, y), `${x}, ${y}`);
  }
});

/** Let every frame after the first have so many slots that the textures, which have 16 384 texels at first, must grow. */
const NEED_MANY_SLOTS = `
  const { get, set } = Object.getOwnPropertyDescriptor(Worker.prototype, "onmessage");
  const growPacket = ({ packet }) => packet?.frame > 0 && (packet.slotLimit = 20_000);
  const wrap = (handler) => handler && ((event) => (growPacket(event.data), handler(event)));
  Object.defineProperty(Worker.prototype, "onmessage", { get, set(handler) { set.call(this, wrap(handler)); } });`;

browserTest("Gaussians stay when the textures grow", async () => {
  const pictures: number[][] = [];
  for (const initScript of ["", NEED_MANY_SLOTS]) {
    await using page = await PlayerPage.open({ initScript });
    await page.waitUntil((player) => player.frame === 0);
    pictures.push(await page.run(async (player) => {
      await player.step(1);
      return [...(await player.takePicture(0))];
    }));
  }
  assert.deepEqual(pictures[1], pictures[0]);
});
