/** The output of `quarc-ref publish` and `quarc-ref view`, in a browser. */

import assert from "node:assert/strict";
import { appendFileSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before } from "node:test";
import { browserTest, launch, PlayerPage, type PlayerElement } from "./browser.js";
import { runPython, skipReference, startPython } from "./reference.js";
import { readRoom } from "./server.js";

const PATIENCE_MS = 60_000;
const SCREENS = { desktop: { width: 1280, height: 800 }, phone: { width: 390, height: 844 } };
const ROOM = new URL("../test/streams/room.quarc", import.meta.url).pathname;

const folder = mkdtempSync(join(tmpdir(), "quarc-site-"));
const site = join(folder, "site");

before(() => {
  if (!skipReference) runPython(["-m", "quarc_ref", "publish", ROOM, "-o", site, "--autoplay", "--title", "A room"]);
});
after(() => rmSync(folder, { recursive: true }));

/** Start a server by a Python command that prints its address. */
async function serving(command: readonly string[], address: RegExp, act: (url: string) => Promise<void>): Promise<void> {
  const server = startPython(command);
  try {
    let said = "";
    const url = await new Promise<string>((resolve, reject) => {
      server.on("exit", () => reject(new Error(`${command.join(" ")} has ended: ${said}`)));
      server.stdout?.on("data", (data) => {
        const found = address.exec((said += String(data)));
        if (found !== null) resolve(found[1] ?? "");
      });
    });
    await act(url.startsWith("http") ? url : `http://127.0.0.1:${url}/`);
  } finally {
    server.kill("SIGKILL");
  }
}

/** Open an address; `act` receives a function that runs code with the player of the page. */
async function visiting(
  url: string,
  act: (visit: {
    run: (act: (player: PlayerElement) => unknown) => Promise<void>;
    until: (holds: (player: PlayerElement) => unknown) => Promise<void>;
    requests: (string | undefined)[];
  }) => Promise<void>,
  viewport = SCREENS.desktop,
  picture = "",
): Promise<void> {
  const page = await (await launch()).newPage({ viewport });
  page.setDefaultTimeout(PATIENCE_MS);
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
    const onPlayer = (act: (player: PlayerElement) => unknown): string =>
      `(${String(act)})(document.querySelector("quarc-player"))`;
    await act({
      run: (act) => page.evaluate(onPlayer(act)),
      until: async (holds) => void (await page.waitForFunction(onPlayer(holds))),
      requests,
    });
    assert.deepEqual(errors, [], "the console shows errors");
    if (picture !== "") await page.screenshot({ path: new URL(picture, import.meta.url).pathname });
  } finally {
    await page.close();
  }
}

const plainServer = (): [string[], RegExp] => [
  ["-m", "http.server", "0", "--bind", "127.0.0.1", "--directory", site],
  /port (\d+) /,
];
const viewer = (...more: string[]): [string[], RegExp] => [
  ["-m", "quarc_ref", "view", "--no-open", "--json", "--port", "8900", ...more],
  /"url": "([^"]+)"/,
];

for (const [name, screen] of Object.entries(SCREENS)) {
  browserTest(`a published folder plays from Python's server on a ${name}`, async (context) => {
    if (skipReference) return context.skip(skipReference);
    await serving(...plainServer(), (url) =>
      visiting(
        url,
        async ({ until }) => {
          await until((player) => (player.frame ?? 0) >= 3 && player.isPlaying);
          await until(() => document.title === "A room");
          await until((player) => {
            const { width, height } = player.getBoundingClientRect();
            return width === innerWidth && height === innerHeight && document.body.scrollHeight <= innerHeight;
          });
        },
        screen,
        `site-${name}.png`,
      ),
    );
  });
}

browserTest("the address of the page sets camera, frame, speed and up, and stops playback", async (context) => {
  if (skipReference) return context.skip(skipReference);
  await serving(...plainServer(), (url) =>
    visiting(`${url}?autoplay=0&camera=side&frame=11&speed=0.5&up=z&loop`, async ({ until }) => {
      await until((player) => player.frame === 11 && !player.isPlaying);
      await until(({ player }) => player?.camera === "side" && player.speed === 0.5 && player.up === "z" && player.loop);
    }),
  );
});

browserTest("view answers range requests, and the player uses them to seek", async (context) => {
  if (skipReference) return context.skip(skipReference);
  await serving(...viewer(ROOM, "--no-autoplay", "--camera", "upright"), (url) =>
    visiting(url, async ({ run, until, requests }) => {
      await until((player) => player.frame === 0 && player.player?.camera === "upright");
      await until((player) => player.info?.frameCount === 24);
      await run((player) => player.setFrame(20));
      await until((player) => player.frame === 20);
      assert.ok(requests.every((range) => range?.startsWith("bytes=")));
    }),
  );
});

browserTest("a growing stream is played to its end", async (context) => {
  if (skipReference) return context.skip(skipReference);
  const room = readFileSync(ROOM);
  const path = join(folder, "live.quarc");
  writeFileSync(path, room.subarray(0, room.length >> 1));
  await serving(...viewer(path, "--follow", "--no-loop"), (url) =>
    visiting(url, async ({ until }) => {
      await until((player) => player.isPlaying && (player.frame ?? 0) >= 3 && player.info?.frameCount === null);
      appendFileSync(path, room.subarray(room.length >> 1));
      await until((player) => player.frame === 23 && !player.isPlaying);
    }),
  );
});

browserTest("the poster is shown until the first frame is shown", async () => {
  const poster = readRoom(); // not a picture: hidden at once
  const isShown = "(player) => !player.shadowRoot.querySelector('.poster').hidden";
  const options = { attributes: 'poster="poster.png"', bitsPerSecond: 100_000 };
  await using broken = await PlayerPage.open({ ...options, files: { "/poster.png": poster } });
  await broken.page.waitForFunction(`!(${isShown})(document.querySelector("quarc-player"))`);
  const picture = await broken.page.screenshot();
  await using page = await PlayerPage.open({ ...options, files: { "/poster.png": picture } });
  await page.page.waitForFunction(`(${isShown})(document.querySelector("quarc-player"))`);
  assert.equal(await page.run((player) => player.frame), null);
  page.server.set({ bitsPerSecond: 1e9 });
  await page.until((player) => player.frame === 0);
  await page.page.waitForFunction(`!(${isShown})(document.querySelector("quarc-player"))`);
});
