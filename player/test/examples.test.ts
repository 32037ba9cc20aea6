/** The pages in examples/ show the stream, with npm packages in place of a CDN. */

import assert from "node:assert/strict";
import { existsSync, readFileSync } from "node:fs";
import { test, type TestContext } from "node:test";
import { fileURLToPath } from "node:url";
import type { Page } from "playwright-core";
import { browserTest, launch, PlayerPage, type PlayerElement } from "./browser.js";
import { readPlayerFile, readRoom, StreamServer } from "./server.js";

const CDN = "https://cdn.jsdelivr.net/npm/";
const PATIENCE_MS = 60_000;
const SIZE = { width: 160, height: 120 }; // of the camera `front`
const LEAST_DB = 24; // the ball moves, and other renderers differ a little
const PAGES = ["component.html", "three.html", "playcanvas.html"];

const at = (path: string): string => fileURLToPath(new URL(`../${path}`, import.meta.url));

/** Run a function on an example's page; no error may be logged. */
async function onExample(name: string, act: (page: Page) => Promise<void>): Promise<void> {
  const files = {
    [`/examples/${name}`]: readPlayerFile(`examples/${name}`),
    "/dist/quarc-player.js": readPlayerFile("dist/quarc-player.js"),
  };
  await using server = await StreamServer.start(readRoom(), { files });
  const page = await (await launch()).newPage({ viewport: SIZE });
  page.setDefaultTimeout(PATIENCE_MS);
  const errors: string[] = [];
  page.on("pageerror", (error) => errors.push(String(error.stack ?? error)));
  page.on("console", (message) => {
    if (message.type() === "error") errors.push(message.text());
  });
  await page.route(`${CDN}**`, async (route) => {
    const path = route.request().url().slice(CDN.length).replace(/@[\d.]+\//, "/");
    await route.fulfill({ contentType: "text/javascript", body: readFileSync(at(`node_modules/${path}`), "utf8") });
  });
  try {
    await page.goto(`${server.origin}/examples/${name}?src=/stream.quarc`);
    await act(page);
    assert.deepEqual(errors, [], "the console shows errors");
  } finally {
    await page.close();
  }
}

/** PSNR of a PNG in base64 against the view of the camera `front` in a frame. Runs on a page. */
async function compare(player: PlayerElement, png: string): Promise<number> {
  const picture = await player.takePicture(0);
  const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${png}`)).blob());
  const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
  context?.drawImage(image, 0, 0);
  const pixels = context?.getImageData(0, 0, image.width, image.height).data ?? [];
  let sum = 0;
  for (let k = 0; k < picture.length; k++) {
    sum += ((picture[k] ?? 0) - (pixels[4 * Math.floor(k / 3) + (k % 3)] ?? 0) / 255) ** 2;
  }
  return 4 * image.width * image.height === pixels.length ? -10 * Math.log10(sum / picture.length) : 0;
}

async function frameOf(page: Page): Promise<number> {
  return Number(/^Frame (\d+)$/.exec(await page.title())?.[1] ?? -1);
}

async function checkRenderer(context: TestContext, name: string): Promise<void> {
  await using player = await PlayerPage.open({ attributes: 'camera="front"' });
  await player.until((element) => element.frame === 0);
  await onExample(name, async (page) => {
    let best = 0;
    for (let look = 0; look < 40 && best < LEAST_DB; look++) {
      await page.waitForTimeout(250);
      const frame = await frameOf(page);
      if (frame < 0) continue;
      const png = (await page.screenshot()).toString("base64");
      await player.setFrame(frame);
      best = Math.max(best, await player.run(compare, png));
    }
    context.diagnostic(`${name}: ${best.toFixed(1)} dB`);
    assert.ok(best >= LEAST_DB, `${best} dB`);
    const shown = await frameOf(page);
    await page.waitForFunction(`document.title !== "Frame ${shown}"`);
  });
}

for (const name of ["three.html", "playcanvas.html"]) {
  browserTest(`${name} draws what the player draws`, async (context) => {
    if (!existsSync(at("node_modules/playcanvas"))) return context.skip("npm ci brings the packages");
    await checkRenderer(context, name);
  });
}

browserTest("component.html controls the component", () =>
  onExample("component.html", async (page) => {
    await page.waitForFunction(`/^Frame \\d+ of 24, \\d+ Gaussians$/.test(caption.textContent)`);
    await page.click("#slow");
    await page.click("#middle");
    await page.waitForFunction(`caption.textContent.startsWith("Frame 12 of")`);
    await page.selectOption("#cameras", "side");
    const state = `(({ player, isPlaying }) => [player.speed, player.camera, isPlaying])(document.querySelector("quarc-player"))`;
    assert.deepEqual(await page.evaluate(state), [0.5, "side", false]);
  }),
);

test("every example fits on a screen", () => {
  for (const name of [...PAGES, "node.mjs"]) {
    const lines = readFileSync(at(`examples/${name}`), "utf8").split("\n").length - 1;
    assert.ok(lines <= 60, `${name} has ${lines} lines`);
  }
});

test("examples use the tested versions", () => {
  for (const name of PAGES) {
    for (const [, id = "", version] of readFileSync(at(`examples/${name}`), "utf8").matchAll(/npm\/((?:@[\w-]+\/)?[\w-]+)@([\d.]+)/g)) {
      const { version: here } = JSON.parse(readFileSync(at(`node_modules/${id}/package.json`), "utf8")) as { version: string };
      assert.equal(version, here, `${name}: ${id}`);
    }
  }
});
