/** The pages of `quarc-ref publish` and `quarc-ref view` in a browser. */

import assert from "node:assert/strict";
import { appendFileSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before } from "node:test";
import { pathToFileURL } from "node:url";
import { KEEP_AUDIO, makeWav } from "./audio-file.js";
import { browserTest, launch, PIXEL_RATIO, PlayerPage, type PlayerElement } from "./browser.js";
import { decodePng } from "./png.js";
import { runPython, referenceSkipReason, startPython } from "./reference.js";
import { readRoom } from "./server.js";

const TIMEOUT_MS = 60_000;
const VIEWPORTS = { desktop: { width: 1280, height: 800 }, phone: { width: 390, height: 844 } };
const ROOM_PATH = new URL("../test/streams/room.quarc", import.meta.url).pathname;

const temporaryFolder = mkdtempSync(join(tmpdir(), "quarc-site-"));
const siteFolder = join(temporaryFolder, "site");

before(() => {
  const options = ["-o", siteFolder, "--autoplay", "--title", "A room"];
  if (!referenceSkipReason) runPython(["-m", "quarc_ref", "publish", ROOM_PATH, ...options]);
});
after(() => rmSync(temporaryFolder, { recursive: true }));

/** Start a server by a Python command that prints its address, and pass the address to `action`. */
async function withServer(
  command: readonly string[],
  address: RegExp,
  action: (url: string) => Promise<void>,
): Promise<void> {
  const server = startPython(command);
  try {
    let output = "";
    const url = await new Promise<string>((resolve, reject) => {
      server.on("exit", () => reject(new Error(`${command.join(" ")} ended before it printed its address: ${output}`)));
      server.stdout?.on("data", (data) => {
        const match = address.exec((output += String(data)));
        if (match !== null) resolve(match[1] ?? "");
      });
    });
    await action(url.startsWith("http") ? url : `http://127.0.0.1:${url}/`);
  } finally {
    server.kill("SIGKILL");
  }
}

/** Open an address; `action` receives functions that run code with the player of the page, and the Range headers. */
async function withPage(
  url: string,
  action: (visit: {
    run: (action: (player: PlayerElement) => unknown) => Promise<void>;
    waitUntil: (condition: (player: PlayerElement) => unknown) => Promise<void>;
    requests: (string | undefined)[];
  }) => Promise<void>,
  viewport = VIEWPORTS.desktop,
): Promise<void> {
  const page = await (await launch()).newPage({ viewport, deviceScaleFactor: PIXEL_RATIO });
  page.setDefaultTimeout(TIMEOUT_MS);
  await page.addInitScript(KEEP_AUDIO);
  const [errors, requests]: [string[], (string | undefined)[]] = [[], []];
  page.on("pageerror", (error) => errors.push(String(error.stack ?? error)));
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type())) errors.push(message.text());
  });
  page.on("request", (request) => {
    if (request.url().endsWith(".quarc")) requests.push(request.headers()["range"]);
  });
  try {
    await page.goto(url);
    const makeExpression = (action: (player: PlayerElement) => unknown): string =>
      `(${String(action)})(document.querySelector("quarc-player"))`;
    await action({
      run: (action) => page.evaluate(makeExpression(action)),
      waitUntil: async (condition) => void (await page.waitForFunction(makeExpression(condition))),
      requests,
    });
    assert.deepEqual(errors, [], "the console shows errors");
  } finally {
    await page.close();
  }
}

declare const audioElement: HTMLAudioElement;

const makePlainServerCommand = (folder = siteFolder): [string[], RegExp] => [
  ["-m", "http.server", "0", "--bind", "127.0.0.1", "--directory", folder],
  /port (\d+) /,
];
const makeViewCommand = (...options: string[]): [string[], RegExp] => [
  ["-m", "quarc_ref", "view", "--no-open", "--json", "--port", "8900", ...options],
  /"url": "([^"]+)"/,
];

for (const [name, viewport] of Object.entries(VIEWPORTS)) {
  browserTest(`a published folder plays from Python's server on a ${name}`, async (context) => {
    if (referenceSkipReason) return context.skip(referenceSkipReason);
    await withServer(...makePlainServerCommand(), (url) =>
      withPage(
        url,
        async ({ waitUntil }) => {
          await waitUntil((player) => (player.frame ?? 0) >= 3 && player.isPlaying);
          await waitUntil(() => document.title === "A room");
          await waitUntil((player) => {
            const { width, height } = player.getBoundingClientRect();
            return width === innerWidth && height === innerHeight && document.body.scrollHeight <= innerHeight;
          });
        },
        viewport,
      ),
    );
  });
}

browserTest("an embedded page can show only its scene, in front of the page around it", async (context) => {
  if (referenceSkipReason) return context.skip(referenceSkipReason);
  await withServer(...makePlainServerCommand(), async (url) => {
    for (const isTransparent of [true, false]) {
      const page = await (await launch()).newPage({ viewport: { width: 160, height: 120 }, deviceScaleFactor: PIXEL_RATIO });
      page.setDefaultTimeout(TIMEOUT_MS);
      const parameters = `?autoplay=0&controls=none&transparent=${isTransparent ? 1 : 0}`;
      await page.setContent(`<body style="margin: 0; background: #f0f">
        <iframe src="${url}${parameters}" style="border: 0; width: 160px; height: 120px"></iframe>`);
      const frame = await (await page.waitForSelector("iframe")).contentFrame();
      await frame?.waitForFunction(`document.querySelector("quarc-player").frame === 0`);
      await frame?.evaluate(`document.querySelector("quarc-player").shadowRoot.querySelector("canvas.view").remove()`);
      const { width, height, pixelAt } = decodePng(await page.screenshot({ scale: "css" }));
      assert.deepEqual(pixelAt(width / 2, height / 2), isTransparent ? [255, 0, 255] : [13, 15, 18]);
      await page.close();
    }
  });
});

browserTest("a single page plays from disk", async (context) => {
  if (referenceSkipReason) return context.skip(referenceSkipReason);
  const path = join(temporaryFolder, "room.html");
  runPython(["-m", "quarc_ref", "publish", ROOM_PATH, "-o", path]);
  await withPage(pathToFileURL(path).href, async ({ run, waitUntil }) => {
    await waitUntil((player) => player.info?.frameCount === 24 && (player.frame ?? 24) < 10);
    await waitUntil((player) => player.getAttribute("poster")?.startsWith("data:image/jpeg;base64,"));
    await run((player) => player.setFrame(20));
    await waitUntil((player) => player.frame === 20);
    await run((player) => player.play());
    await waitUntil((player) => player.frame === 23 && !player.isPlaying);
  });
});

browserTest("published audio plays from Python's server, which has no ranges, and from disk", async (context) => {
  if (referenceSkipReason) return context.skip(referenceSkipReason);
  const [folder, pagePath, audioPath] = ["sound", "sound.html", "a.wav"].map((name) => join(temporaryFolder, name));
  writeFileSync(audioPath!, makeWav(5));
  const options = ["--audio", audioPath!, "--audio-start", "2", "--loop", "--autoplay"];
  for (const output of [folder, pagePath]) runPython(["-m", "quarc_ref", "publish", ROOM_PATH, "-o", output!, ...options]);
  const isInSync = (player: PlayerElement): boolean =>
    !audioElement.paused && Math.abs(audioElement.currentTime - 2 - (player.frame ?? 0) / 30) < 0.15;
  await withServer(...makePlainServerCommand(folder), (url) =>
    withPage(`${url}?muted`, async ({ waitUntil }) => {
      await waitUntil(isInSync);
      await waitUntil(({ player }) => player?.muted && audioElement.seekable.length > 0 && audioElement.seekable.end(0) === 5);
    }),
  );
  await withPage(pathToFileURL(pagePath!).href, ({ waitUntil }) => waitUntil(isInSync));
});

browserTest("the address of the page sets camera, frame, speed and up, and stops playback", async (context) => {
  if (referenceSkipReason) return context.skip(referenceSkipReason);
  await withServer(...makePlainServerCommand(), async (url) => {
    await withPage(`${url}?autoplay=0&camera=side&frame=11&speed=0.5&up=z&loop`, async ({ waitUntil }) => {
      await waitUntil((player) => player.frame === 11 && !player.isPlaying);
      await waitUntil(({ player }) => player?.camera === "side" && player.speed === 0.5 && player.up === "z" && player.loop);
    });
    await withPage(`${url}?camera=0`, ({ waitUntil }) => waitUntil((player) => player.getAttribute("camera") === "0"));
  });
});

browserTest("view answers range requests, and the player uses them to seek", async (context) => {
  if (referenceSkipReason) return context.skip(referenceSkipReason);
  await withServer(...makeViewCommand(ROOM_PATH, "--no-autoplay", "--camera", "upright"), (url) =>
    withPage(url, async ({ run, waitUntil, requests }) => {
      await waitUntil((player) => player.frame === 0 && player.player?.camera === "upright");
      await waitUntil((player) => player.info?.frameCount === 24);
      await run((player) => player.setFrame(20));
      await waitUntil((player) => player.frame === 20);
      assert.ok(requests.every((range) => range?.startsWith("bytes=")));
    }),
  );
});

browserTest("a growing stream is played to its end", async (context) => {
  if (referenceSkipReason) return context.skip(referenceSkipReason);
  const room = readFileSync(ROOM_PATH);
  const path = join(temporaryFolder, "live.quarc");
  writeFileSync(path, room.subarray(0, room.length >> 1));
  await withServer(...makeViewCommand(path, "--follow", "--no-loop"), (url) =>
    withPage(url, async ({ waitUntil }) => {
      await waitUntil((player) => player.isPlaying && (player.frame ?? 0) >= 3 && player.info?.frameCount === null);
      appendFileSync(path, room.subarray(room.length >> 1));
      await waitUntil((player) => player.frame === 23 && !player.isPlaying);
    }),
  );
});

browserTest("the poster is visible until the first frame is shown", async () => {
  const invalidPoster = readRoom(); // not a picture, so it is hidden at once
  const isShown = "(player) => !player.shadowRoot.querySelector('.poster').hidden";
  const options = { attributes: 'poster="poster.png"', bitsPerSecond: 100_000 };
  await using brokenPage = await PlayerPage.open({ ...options, files: { "/poster.png": invalidPoster } });
  await brokenPage.page.waitForFunction(`!(${isShown})(document.querySelector("quarc-player"))`);
  const screenshotPath = await brokenPage.page.screenshot();
  await using page = await PlayerPage.open({ ...options, files: { "/poster.png": screenshotPath } });
  await page.page.waitForFunction(`(${isShown})(document.querySelector("quarc-player"))`);
  assert.equal(await page.run((player) => player.frame), null);
  page.server.setOptions({ bitsPerSecond: 1e9 });
  await page.waitUntil((player) => player.frame === 0);
  await page.page.waitForFunction(`!(${isShown})(document.querySelector("quarc-player"))`);
});
