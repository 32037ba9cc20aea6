/** Playback of growing streams, and seeks past an end that is not known yet. */

import assert from "node:assert/strict";
import { browserTest, PlayerPage, type PageOptions } from "./browser.js";
import { readRoom } from "./server.js";

const FRAME_COUNT = 24; // of room.quarc
const room = readRoom();
const firstHalf = room.subarray(0, room.length >> 1);

/** Open a page with the first half of room.quarc as a live stream. */
const openLive = (attributes = "", options: PageOptions = {}): Promise<PlayerPage> =>
  PlayerPage.open({ ...options, stream: firstHalf, attributes: `live ${attributes}`, expectedErrors: /416|503/ });

const findLiveButton = (page: PlayerPage) => page.page.locator("quarc-player #live");

for (const supportsRanges of [true, false]) {
  browserTest(`a live stream is followed ${supportsRanges ? "with" : "without"} range requests`, async () => {
    await using page = await openLive('autoplay speed="4"', { supportsRanges });
    await page.page.locator("quarc-player .waiting").waitFor();
    const lastShown = await page.run((player) => player.frame);
    assert.ok(lastShown !== null && lastShown > 0 && lastShown < FRAME_COUNT - 1);
    assert.equal(await page.run(({ player }) => player?.liveEdge), lastShown);
    assert.equal(await findLiveButton(page).getAttribute("aria-pressed"), "true");
    const [red, green, blue] = (await page.takeScreenshot()).pixelAt(240, 220);
    assert.ok(red + green + blue > 60, "the last picture must stay on the screen");
    page.server.grow(room);
    await page.waitUntil((player) => player.frame === 23 && !player.isPlaying);
    assert.equal(await page.page.locator("quarc-player .waiting").isVisible(), false);
    await findLiveButton(page).waitFor({ state: "hidden" });
    assert.equal(await page.run(({ player }) => player?.liveEdge), null, "an ended stream has no live edge");
  });
}

browserTest("a paused live stream shows its latency, and a button jumps to its newest frame", async () => {
  await using page = await openLive();
  await page.waitUntil((player) => player.frame === 0 && (player.player?.liveEdge ?? 0) > 0);
  const firstLiveEdge = await page.run(({ player }) => player?.liveEdge ?? 0);
  await page.run((player) => {
    player.addEventListener("liveedge", ({ detail }) => (player.dataset["edge"] = String(detail.frame)));
  });
  page.server.grow(room.subarray(0, room.length - 500)); // includes the canonical frame 12
  await page.page.waitForFunction(`Number(document.querySelector("quarc-player").dataset.edge) > ${firstLiveEdge}`);
  const newLiveEdge = await page.run((player) => Number(player.dataset["edge"]));
  const latencyFigures = await page.run(({ player }) => [player?.statistics?.framesBehind, player?.latency]);
  assert.deepEqual(latencyFigures, [newLiveEdge, newLiveEdge / 30]);
  await page.run((player) => player.setAttribute("speed", "0.25")); // so that the next frames are not available at once
  await findLiveButton(page).click();
  await page.waitUntil(({ frame, isPlaying, player }) => frame === player?.liveEdge && isPlaying);
  assert.equal(await page.run(({ player }) => player?.latency), 0);
});

browserTest("the timeline of a paused live stream grows with the stream up to its end, also after a failure of the server", async () => {
  await using page = await openLive();
  const waitForTimeline = (lastFrame: number): Promise<unknown> =>
    page.page.locator(`quarc-player input[type=range][max="${lastFrame}"]`).waitFor();
  await waitForTimeline(11);
  page.server.grow(room.subarray(0, room.length - 500));
  await waitForTimeline(18);
  page.server.setOptions({ status: 503 });
  await page.page.waitForTimeout(4000); // longer than all retries
  page.server.setOptions({ status: null });
  page.server.grow(room);
  await waitForTimeline(23);
  await findLiveButton(page).click();
  await page.waitUntil((player) => player.frame === 23 && !player.isPlaying);
});

browserTest("a step resolves to the last frame if the stream ends instead", async () => {
  await using page = await openLive();
  await page.waitUntil((player) => player.frame === 0);
  page.server.grow(room.subarray(0, room.length - 100)); // all frames, but neither INDX nor TAIL
  await page.waitUntil(({ player }) => player?.liveEdge === 23);
  await page.run((player) => player.seekToLiveEdge());
  const step = page.run((player) => player.step());
  await page.page.waitForTimeout(200);
  page.server.grow(room);
  assert.equal(await step, 23);
});

browserTest("a large latency is shown on the live button", async () => {
  await using page = await openLive();
  await page.waitUntil((player) => player.frame === 0);
  // The 24 frames last less than a second, so the test overrides the latency.
  await page.run(({ player }) => Object.defineProperty(player, "latency", { value: 12.34 }));
  await page.run(({ player }) => player?.dispatchEvent(new CustomEvent("view", { detail: null })));
  await page.page.waitForFunction(
    `document.querySelector("quarc-player").shadowRoot.querySelector("#live").innerText === "Live −12.3 s"`,
  );
  assert.equal(await findLiveButton(page).getAttribute("aria-pressed"), "false");
});

browserTest("a seek past the newest frame of a live stream goes to that frame", async () => {
  await using page = await openLive();
  await page.waitUntil((player) => player.frame === 0);
  const [shownFrame, liveEdge] = await page.run(async (player) => [await player.setFrame(1000), player.player?.liveEdge]);
  assert.ok(shownFrame !== null && shownFrame !== undefined && shownFrame > 0 && shownFrame < FRAME_COUNT - 1);
  assert.equal(shownFrame, liveEdge);
  page.server.grow(room);
  await page.run((player) => player.step());
  assert.equal(await page.run((player) => player.frame), shownFrame + 1);
});

for (const supportsRanges of [true, false]) {
  browserTest(`a seek past an unknown end goes to the last frame ${supportsRanges ? "with" : "without"} range requests`, async () => {
    for (const target of ["100", "Infinity"]) {
      const heldFrom = room.length - 100; // INDX and TAIL arrive only after the seek has begun
      await using page = await PlayerPage.open({ supportsRanges, attributes: null, heldFrom });
      const endFrame = await page.page.evaluate(async (frame) => {
        const { Player } = await import(`${location.origin}/quarc-player.js`);
        const player = new Player(document.body.appendChild(document.createElement("canvas")));
        await player.open({ url: `${location.origin}/stream.quarc` });
        const { endFrame } = player;
        Object.assign(globalThis, { player, shown: player.setFrame(Number(frame)) });
        return endFrame;
      }, target);
      page.server.setOptions({ heldFrom: Infinity });
      const shownFrame = await page.page.evaluate("shown.then((frame) => [frame, player.targetFrame])");
      assert.deepEqual([endFrame, shownFrame], [null, [23, 23]]);
    }
  });
}

browserTest("opening at a frame past the end shows the last frame", async () => {
  await using page = await PlayerPage.open({ attributes: 'frame="99"' });
  await page.waitUntil((player) => player.frame === 23);
});

browserTest("setFrame and step reject what is not a number with a RangeError", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  const names = await page.run(async (player) => {
    const getName = ({ name }: Error): string => name;
    const invalidFrames = [NaN, undefined, "last"] as number[]; // in JavaScript
    const setNames = await Promise.all(invalidFrames.map((frame) => player.setFrame(frame).catch(getName)));
    return [...setNames, await player.step(NaN).catch(getName)];
  });
  assert.deepEqual(names, ["RangeError", "RangeError", "RangeError", "RangeError"]);
});
