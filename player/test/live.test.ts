/** Growing streams while they are played, and seeks to a last frame that is not known yet. */

import assert from "node:assert/strict";
import { browserTest, PlayerPage, type PageOptions } from "./browser.js";
import { readRoom } from "./server.js";

const FRAMES = 24; // of the room
const room = readRoom();
const half = room.subarray(0, room.length >> 1);

/** A page with the first half of the room, live. */
const openLive = (attributes = "", options: PageOptions = {}): Promise<PlayerPage> =>
  PlayerPage.open({ ...options, stream: half, attributes: `live ${attributes}`, expectedErrors: /416/ });

const button = (page: PlayerPage) => page.page.locator("quarc-player #live");

for (const ranges of [true, false]) {
  browserTest(`a live stream is followed, ${ranges ? "with" : "without"} ranges; the last frame stays while it does not grow`, async () => {
    await using page = await openLive('autoplay speed="4"', { ranges });
    await page.page.locator("quarc-player .waiting").waitFor();
    const stopped = await page.run((player) => player.frame);
    assert.ok(stopped !== null && stopped > 0 && stopped < FRAMES - 1);
    assert.equal(await page.run(({ player }) => player?.liveEdge), stopped);
    assert.equal(await button(page).getAttribute("aria-pressed"), "true");
    const [red, green, blue] = (await page.look()).at(240, 220);
    assert.ok(red + green + blue > 60, "the picture has disappeared");
    page.server.grow(room);
    await page.until((player) => player.frame === 23 && !player.isPlaying);
    assert.equal(await page.page.locator("quarc-player .waiting").isVisible(), false);
    await button(page).waitFor({ state: "hidden" });
    assert.equal(await page.run(({ player }) => player?.liveEdge), null, "it is no longer live");
  });
}

browserTest("a paused live stream shows its latency, and a button jumps to its newest frame", async () => {
  await using page = await openLive();
  await page.until((player) => player.frame === 0 && (player.player?.liveEdge ?? 0) > 0);
  const first = await page.run(({ player }) => player?.liveEdge ?? 0);
  await page.run((player) => {
    player.addEventListener("liveedge", ({ detail }) => (player.dataset["edge"] = String(detail.frame)));
  });
  page.server.grow(room.subarray(0, room.length - 500)); // over the canonical frame 12
  await page.page.waitForFunction(`Number(document.querySelector("quarc-player").dataset.edge) > ${first}`);
  const grown = await page.run((player) => Number(player.dataset["edge"]));
  const figures = await page.run(({ player }) => [player?.statistics?.framesBehind, player?.latency]);
  assert.deepEqual(figures, [grown, grown / 30]);
  await page.run((player) => player.setAttribute("speed", "0.25")); // so that the next frames are not available at once
  await button(page).click();
  await page.until(({ frame, isPlaying, player }) => frame === player?.liveEdge && isPlaying);
  assert.equal(await page.run(({ player }) => player?.latency), 0);
});

browserTest("a large latency is shown on the live button", async () => {
  await using page = await openLive();
  await page.until((player) => player.frame === 0);
  // 24 frames last less than a second, so the latency is replaced.
  await page.run(({ player }) => Object.defineProperty(player, "latency", { value: 12.34 }));
  await page.run(({ player }) => player?.dispatchEvent(new CustomEvent("view", { detail: null })));
  await page.page.waitForFunction(
    `document.querySelector("quarc-player").shadowRoot.querySelector("#live").innerText === "Live −12.3 s"`,
  );
  assert.equal(await button(page).getAttribute("aria-pressed"), "false");
});

browserTest("a seek past the newest frame of a live stream goes to that frame", async () => {
  await using page = await openLive();
  await page.until((player) => player.frame === 0);
  const [shown, edge] = await page.run(async (player) => [await player.setFrame(1000), player.player?.liveEdge]);
  assert.ok(shown !== null && shown !== undefined && shown > 0 && shown < FRAMES - 1);
  assert.equal(shown, edge);
  page.server.grow(room);
  await page.run((player) => player.step());
  assert.equal(await page.run((player) => player.frame), shown + 1);
});

for (const ranges of [true, false]) {
  browserTest(`a seek past an unknown end goes to the last frame, ${ranges ? "with" : "without"} ranges`, async () => {
    for (const to of ["100", "Infinity"]) {
      await using page = await PlayerPage.open({ ranges, attributes: null, bitsPerSecond: 2e6 });
      const shown = await page.page.evaluate(async (frame) => {
        const { Player } = await import(`${location.origin}/quarc-player.js`);
        const player = new Player(document.body.appendChild(document.createElement("canvas")));
        await player.open({ url: `${location.origin}/stream.quarc` });
        const { endFrame } = player;
        return [endFrame, await player.setFrame(Number(frame)), player.targetFrame];
      }, to);
      assert.deepEqual(shown, [null, 23, 23]);
    }
  });
}

browserTest("opening at a frame past the end shows the last frame", async () => {
  await using page = await PlayerPage.open({ attributes: 'frame="99"' });
  await page.until((player) => player.frame === 23);
});

browserTest("an invalid ordinal is rejected by name", async () => {
  await using page = await PlayerPage.open();
  await page.until((player) => player.frame === 0);
  const name = await page.run((player) => player.setFrame(NaN).catch((error: Error) => error.name));
  assert.equal(name, "RangeError");
});
