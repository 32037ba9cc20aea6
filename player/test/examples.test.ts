/** The pages in examples/ show a stream; npm packages replace the files of the CDN. */

import assert from "node:assert/strict";
import { existsSync, readFileSync } from "node:fs";
import { test, type TestContext } from "node:test";
import { fileURLToPath } from "node:url";
import type { Page } from "playwright-core";
import { browserTest, launch, PlayerPage, type PlayerElement } from "./browser.js";
import { readPlayerFile, readRoom, StreamServer, type ServerOptions } from "./server.js";

const CDN = "https://cdn.jsdelivr.net/npm/";
const TIMEOUT_MS = 60_000;
const VIEWPORT = { width: 160, height: 120 }; // of the camera `front`
const MIN_DB = { "three.html": 35, "playcanvas.html": 25 }; // the other renderers differ slightly
const HELD_FRAME = 11; // the last frame in the first half of room.quarc
/** Half of the stream is sent; without range requests, a page shows its frames before the index has arrived. */
const HALF_SENT: ServerOptions = { supportsRanges: false, heldFrom: readRoom().length >> 1 };
/** The player that every clone of the repository has, where the pages look for it; the tests replace it by a new build. */
const KEPT_PLAYER = "/quarc_ref/viewing/player/quarc-player.js";
const EXAMPLE_PAGES = ["component.html", "three.html", "playcanvas.html"];

const resolvePath = (packagePath: string): string => fileURLToPath(new URL(`../${packagePath}`, import.meta.url));

/** Run a function on the page of an example; the page may not log an error. */
async function runOnExample(
  name: string,
  options: ServerOptions,
  action: (page: Page, server: StreamServer) => Promise<void>,
): Promise<void> {
  const files = {
    [`/player/examples/${name}`]: readPlayerFile(`examples/${name}`),
    [KEPT_PLAYER]: readPlayerFile("dist/quarc-player.js"),
  };
  await using server = await StreamServer.start(readRoom(), { ...options, files });
  const page = await (await launch()).newPage({ viewport: VIEWPORT });
  page.setDefaultTimeout(TIMEOUT_MS);
  const errors: string[] = [];
  page.on("pageerror", (error) => errors.push(String(error.stack ?? error)));
  page.on("console", (message) => {
    if (message.type() === "error") errors.push(message.text());
  });
  await page.route(`${CDN}**`, async (route) => {
    const packagePath = route.request().url().slice(CDN.length).replace(/@[\d.]+\//, "/");
    await route.fulfill({ contentType: "text/javascript", body: readFileSync(resolvePath(`node_modules/${packagePath}`), "utf8") });
  });
  try {
    await page.goto(`${server.origin}/player/examples/${name}?src=/stream.quarc`);
    await action(page, server);
    assert.deepEqual(errors, [], "the console shows errors");
  } finally {
    await page.close();
  }
}

/** Return the PSNR between a PNG in base64 and the player's picture from the camera `front`. Runs on a page. */
async function computePsnr(player: PlayerElement, png: string): Promise<number> {
  const picture = await player.takePicture(0);
  const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${png}`)).blob());
  const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
  context?.drawImage(image, 0, 0);
  const pixels = context?.getImageData(0, 0, image.width, image.height).data ?? [];
  let sum = 0;
  for (let channel = 0; channel < picture.length; channel++) {
    sum += ((picture[channel] ?? 0) - (pixels[4 * Math.floor(channel / 3) + (channel % 3)] ?? 0) / 255) ** 2;
  }
  return 4 * image.width * image.height === pixels.length ? -10 * Math.log10(sum / picture.length) : 0;
}

async function checkRenderer(context: TestContext, name: keyof typeof MIN_DB): Promise<void> {
  await using player = await PlayerPage.open({ attributes: 'camera="front"' });
  await player.waitUntil((element) => element.frame === 0);
  await runOnExample(name, HALF_SENT, async (page, server) => {
    await page.waitForFunction(`document.title === "Frame ${HELD_FRAME}"`);
    await player.setFrame(HELD_FRAME);
    let psnr = 0;
    for (let attempt = 0; attempt < 40 && psnr < MIN_DB[name]; attempt++) { // the frame is drawn after the title has been set
      const png = (await page.screenshot()).toString("base64");
      psnr = await player.run(computePsnr, png);
    }
    context.diagnostic(`${name}: ${psnr.toFixed(1)} dB`);
    assert.ok(psnr >= MIN_DB[name], `the PSNR is ${psnr} dB`);
    server.setOptions({ heldFrom: Infinity });
    await page.waitForFunction(`document.title !== "Frame ${HELD_FRAME}"`);
  });
}

for (const name of ["three.html", "playcanvas.html"] as const) {
  browserTest(`${name} draws what the player draws`, async (context) => {
    if (!existsSync(resolvePath("node_modules/playcanvas"))) return context.skip("PlayCanvas is not installed: run npm ci");
    await checkRenderer(context, name);
  });
}

browserTest("component.html controls the component", () =>
  runOnExample("component.html", {}, async (page) => {
    await page.waitForFunction(`/^Frame \\d+ of 24, \\d+ Gaussians$/.test(caption.textContent)`);
    await page.click("#slow");
    await page.click("#middle");
    await page.waitForFunction(`caption.textContent.startsWith("Frame 12 of")`);
    await page.selectOption("#cameras", "side");
    const state = `(({ player, isPlaying }) => [player.speed, player.camera, isPlaying])(document.querySelector("quarc-player"))`;
    assert.deepEqual(await page.evaluate(state), [0.5, "side", false]);
  }),
);

test("the pages work in a clone, without a build of the player", () => {
  for (const name of EXAMPLE_PAGES) {
    const page = readFileSync(resolvePath(`examples/${name}`), "utf8");
    const [, path = ""] = /"([^"]*\/quarc-player\.js)"/.exec(page) ?? [];
    assert.equal(new URL(path, `http://localhost/player/examples/${name}`).pathname, KEPT_PLAYER);
  }
  assert.ok(existsSync(resolvePath(`..${KEPT_PLAYER}`)));
});

test("every example has at most 60 lines", () => {
  for (const name of [...EXAMPLE_PAGES, "node.mjs"]) {
    const lines = readFileSync(resolvePath(`examples/${name}`), "utf8").split("\n").length - 1;
    assert.ok(lines <= 60, `${name} has ${lines} lines`);
  }
});

test("the examples name the versions of the installed packages", () => {
  for (const name of EXAMPLE_PAGES) {
    for (const [, packageName = "", version] of readFileSync(resolvePath(`examples/${name}`), "utf8").matchAll(/npm\/((?:@[\w-]+\/)?[\w-]+)@([\d.]+)/g)) {
      const { version: installedVersion } = JSON.parse(readFileSync(resolvePath(`node_modules/${packageName}/package.json`), "utf8")) as { version: string };
      assert.equal(version, installedVersion, `${name}: ${packageName}`);
    }
  }
});
