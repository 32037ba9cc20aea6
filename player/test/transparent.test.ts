/** A transparent player shows the page behind the scene, and in augmented reality the room. */

import assert from "node:assert/strict";
import { browserTest, PlayerPage } from "./browser.js";
import { makeEmulatorScript, SIZE } from "./emulator.js";

const MAGENTA_PAGE = `addEventListener("DOMContentLoaded", () => (document.body.style.background = "#f0f"));`;
const HELD_FROM = 25_000; // in the first frame, after the bytes of its preview
const RECORD_MODES = `
  window.modes = [];
  const requestSession = navigator.xr.requestSession.bind(navigator.xr);
  navigator.xr.requestSession = (mode, ...rest) => (window.modes.push(mode), requestSession(mode, ...rest));`;

/** Return the share of a screenshot that is magenta. */
async function measureMagenta(page: PlayerPage): Promise<number> {
  const { width, height, pixelAt } = await page.takeScreenshot();
  const pixels = Array.from({ length: width * height }, (_, index) => pixelAt(index % width, Math.floor(index / width)));
  return pixels.filter(([red, green, blue]) => red > 235 && green < 20 && blue > 235).length / pixels.length;
}

/** Open a player on a magenta page, and fly back, so that the scene does not fill the picture. */
async function openFarAway(attributes: string): Promise<PlayerPage> {
  const page = await PlayerPage.open({ attributes: `controls="none" ${attributes}`, ...SIZE, initScript: MAGENTA_PAGE });
  await page.waitUntil((player) => player.frame === 0);
  await page.page.locator("quarc-player").focus();
  await page.run(({ player }) => (player!.camera = "front"));
  for (let press = 0; press < 12; press++) await page.page.keyboard.press("s");
  return page;
}

browserTest("only a transparent player shows the page behind the scene", async () => {
  await using transparentPage = await openFarAway("transparent");
  while ((await measureMagenta(transparentPage)) < 0.1);
  await using blackPage = await openFarAway("");
  assert.ok((await measureMagenta(blackPage)) < 0.01); // the corners are round
});

browserTest("while a transparent poster is shown, neither the previous stream nor a preview is visible behind it", async () => {
  const poster = `poster="data:image/svg+xml,<svg xmlns='http://www.w3.org/2000/svg'/>"`;
  const attributes = `controls="none" transparent ${poster}`;
  await using page = await PlayerPage.open({ attributes, ...SIZE, initScript: MAGENTA_PAGE });
  await page.waitUntil((player) => player.frame === 0);
  while ((await measureMagenta(page)) > 0.9); // the scene appears
  page.server.setOptions({ heldFrom: HELD_FROM });
  await page.run(async (player) => {
    const previewed = new Promise((resolve) => player.addEventListener("preview", resolve, { once: true }));
    player.setAttribute("src", "stream.quarc?again");
    await previewed;
  });
  assert.ok((await measureMagenta(page)) > 0.8); // the loading panel hides the rest
});

browserTest("a canvas on which players are transparent cannot get another kind of player, and vice versa", async () => {
  await using page = await PlayerPage.open({ attributes: null });
  for (const transparent of [false, true]) {
    const error = await page.page.evaluate(async (transparent) => {
      const { Player, DrawingError } = await import(`${location.origin}/quarc-player.js`);
      const canvas = document.body.appendChild(document.createElement("canvas"));
      for (let count = 0; count < 2; count++) new Player(canvas, { transparent }).dispose();
      try {
        return String(new Player(canvas, { transparent: !transparent }));
      } catch (error) {
        return `${error instanceof DrawingError}: ${(error as Error).message}`;
      }
    }, transparent);
    assert.equal(error, `true: the context of this canvas is ${transparent ? "" : "not "}transparent: use another canvas`);
  }
});

browserTest("a transparent scene is shown in the room, any other scene in front of black", async () => {
  for (const [attributes, mode] of [["transparent", "immersive-ar"], ["", "immersive-vr"]] as const) {
    await using page = await PlayerPage.open({ attributes, ...SIZE, initScript: makeEmulatorScript() + RECORD_MODES });
    await page.waitUntil((player) => player.frame === 0);
    await page.page.locator("quarc-player #headset").click();
    await page.waitUntil(({ player }) => player?.isInHeadset === true);
    assert.deepEqual(await page.page.evaluate("modes"), [mode]);
    await page.run(({ player }) => player?.leaveHeadset());
    await page.waitUntil(({ player }) => player?.isInHeadset === false);
  }
});
