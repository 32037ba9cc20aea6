/** The player's pictures match those of `quarc-ref render`, up to the rounding of the target. */

import assert from "node:assert/strict";
import { browserTest, PlayerPage, type PlayerElement } from "./browser.js";
import { renderReference, skipReference } from "./reference.js";
import { readRoom } from "./server.js";

const FRAMES = [0, 11, 23];
const CAMERAS = ["front", "upright"];
const LEAST_DB = { float: 45, bytes: 40 } as const;

/** The PSNR of a camera's view against a PNG, for a picture of this depth. Runs on the page. */
async function compare(
  player: PlayerElement,
  { camera, path, depth }: { camera: string; path: string; depth: "float" | "bytes" },
): Promise<number> {
  const index = player.player?.cameras.findIndex(({ name }) => name === camera) ?? -1;
  const picture = await player.takePicture(index, depth);
  const image = await createImageBitmap(await (await fetch(path)).blob());
  const canvas = new OffscreenCanvas(image.width, image.height);
  const context = canvas.getContext("2d");
  context?.drawImage(image, 0, 0);
  const pixels = context?.getImageData(0, 0, image.width, image.height).data ?? [];
  let sum = 0;
  for (let at = 0; at < picture.length; at++) {
    const due = (pixels[4 * Math.floor(at / 3) + (at % 3)] ?? 0) / 255;
    sum += ((picture[at] ?? 0) - due) ** 2;
  }
  return 4 * image.width * image.height === pixels.length ? -10 * Math.log10(sum / picture.length) : 0;
}

browserTest("pictures match those of quarc-ref render", async (context) => {
  if (skipReference) return context.skip(skipReference);
  const room = readRoom();
  const files: Record<string, Uint8Array> = {};
  for (const camera of CAMERAS) {
    for (const frame of FRAMES) files[`/${camera}-${frame}.png`] = renderReference(room, camera, frame);
  }
  await using page = await PlayerPage.open({ files });
  await page.until((player) => player.frame === 0);
  for (const frame of FRAMES) {
    await page.setFrame(frame);
    for (const camera of CAMERAS) {
      for (const depth of ["float", "bytes"] as const) {
        const psnr = await page.run(compare, { camera, path: `${camera}-${frame}.png`, depth });
        context.diagnostic(`frame ${frame}, ${camera}, ${depth}: ${psnr.toFixed(1)} dB`);
        assert.ok(psnr >= LEAST_DB[depth], `frame ${frame}, ${camera}, ${depth}: ${psnr} dB`);
      }
    }
  }
});
