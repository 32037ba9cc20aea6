/** Playback in a browser: seeks, steps, loops, and the start and end of a stream. */

import assert from "node:assert/strict";
import { browserTest, PlayerPage, type PlayerElement } from "./browser.js";
import type { StreamError } from "../src/stream-error.js";
import { readRoom } from "./server.js";

/** Draw the current frame from the first camera, as 8-bit values. Runs on the page. */
async function takePictureBytes(player: PlayerElement): Promise<number[]> {
  const picture = await player.takePicture(0);
  return Array.from(picture, (value) => Math.round(255 * value));
}

/** Step to a frame; return the shown frames. Runs on the page. */
async function stepTo(player: PlayerElement, last: number): Promise<number[]> {
  const frames = [];
  while ((player.frame ?? last) < last) {
    const shown = new Promise((resolve) => player.addEventListener("frame", resolve, { once: true }));
    player.step(1);
    await shown;
    frames.push(player.frame ?? -1);
  }
  return frames;
}

/** Play, and return the next `count` shown frames. Runs on the page. */
function playFrames(player: PlayerElement, count: number): Promise<number[]> {
  const frames: number[] = [];
  return new Promise((resolve) => {
    player.addEventListener("frame", () => {
      frames.push(player.frame ?? -1);
      if (frames.length === count) resolve(frames);
    });
    player.play();
  });
}

browserTest("a seek shows the same picture as playing up to the frame", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  const expectedPictures = new Map<number, number[]>();
  for (const frame of [3, 13, 17]) {
    const frames = await page.run(stepTo, frame);
    assert.equal(frames.at(-1), frame);
    expectedPictures.set(frame, await page.run(takePictureBytes));
  }
  for (const frame of [13, 3, 17]) {
    await page.setFrame(frame);
    const picture = await page.run(takePictureBytes);
    const differences = picture.map((value, index) => Math.abs(value - (expectedPictures.get(frame)?.[index] ?? 0)));
    assert.ok(Math.max(...differences) <= 2, `frame ${frame}`); // Gaussians at the same depth may be drawn in another order
  }
});

browserTest("steps go forward and back across canonical frames, and stop at both ends", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  assert.deepEqual(await page.run(stepTo, 13), [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13]);
  for (const frame of [12, 11]) {
    await page.run((player) => player.step(-1));
    await page.page.waitForFunction(`document.querySelector("quarc-player").frame === ${frame}`);
  }
  await page.run((player) => player.step(-20));
  await page.waitUntil((player) => player.frame === 0);
  await page.run((player) => player.step(1000));
  await page.waitUntil((player) => player.frame === 23);
});

browserTest("a loop shows every frame in order in every lap", async () => {
  await using page = await PlayerPage.open({ attributes: 'loop speed="4"' });
  await page.waitUntil((player) => player.frame === 0);
  const frames = await page.run(playFrames, 60);
  assert.deepEqual(frames, Array.from({ length: 60 }, (_, index) => (index + 1) % 24));
  assert.equal(page.server.requests.length, 1, "further laps must not send requests");
  // Frames of the next lap are already decoded, but must not be shown after the loop is disabled.
  const ended = page.run(
    (player) => new Promise((resolve) => player.addEventListener("ended", () => resolve(player.frame))),
  );
  await page.run((player) => player.removeAttribute("loop"));
  assert.equal(await ended, 23);
});

browserTest("playback pauses at the end, and restarts from the beginning", async () => {
  await using page = await PlayerPage.open({ attributes: 'autoplay speed="8"' });
  await page.waitUntil((player) => player.frame === 23 && !player.isPlaying);
  assert.deepEqual((await page.run(playFrames, 5)).slice(0, 3), [0, 1, 2]);
});

browserTest("playback restarts from the beginning after a loop has been enabled and disabled at the end", async () => {
  await using page = await PlayerPage.open({ attributes: 'autoplay speed="8"' });
  await page.waitUntil((player) => player.frame === 23 && !player.isPlaying);
  await page.run((player) => player.toggleAttribute("loop"));
  await page.waitUntil(({ player }) => (player?.statistics?.bufferedFrames ?? 0) > 0); // frames of the next lap
  await page.run((player) => player.toggleAttribute("loop"));
  assert.deepEqual((await page.run(playFrames, 5)).slice(0, 3), [0, 1, 2]);
});

browserTest("a change of the speed also changes the time of the frame that is due next", async () => {
  await using page = await PlayerPage.open({ attributes: 'speed="1e-6"' });
  await page.waitUntil((player) => player.frame === 0);
  await page.run((player) => player.play());
  await page.waitUntil((player) => player.frame === 1); // the next is due in nine hours
  await page.run((player) => player.setAttribute("speed", "8"));
  await page.waitUntil((player) => player.frame === 23);
});

browserTest("no frame follows the frame at which playback is paused", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  const frames = await page.run(async (player) => {
    player.addEventListener("frame", ({ detail }) => {
      if (detail.frame === 18) player.pause(); // all frames have been decoded by then
    });
    player.play();
    while (player.frame !== 18) await new Promise((resolve) => setTimeout(resolve, 5));
    await new Promise((resolve) => setTimeout(resolve, 300));
    return player.frame;
  });
  assert.equal(frames, 18);
});

browserTest("an element that is removed pauses, and does not play when it is inserted again", async () => {
  await using page = await PlayerPage.open({ attributes: "loop" });
  await page.waitUntil((player) => player.frame === 0);
  const states = await page.run(async (player) => {
    let pauses = 0;
    player.addEventListener("pause", () => (pauses += 1));
    player.play();
    const before = player.hasAttribute("playing");
    document.body.append(player);
    return [before, pauses, player.isPlaying, player.hasAttribute("playing")];
  });
  assert.deepEqual(states, [true, 1, false, false]);
});

browserTest("pending promises reject when the player is disposed or its element is removed", async () => {
  await using page = await PlayerPage.open({ bitsPerSecond: 400_000 });
  await page.waitUntil((player) => player.frame === 0);
  const messages = await page.run(async (element) => {
    const { Player } = await import(`${location.origin}/quarc-player.js`);
    const player = new Player(document.body.appendChild(document.createElement("canvas")));
    const promises: Promise<unknown>[] = [player.setFrame(3), player.open({ url: "stream.quarc" }), element.setFrame(20)];
    element.step(); // a promise that nobody uses is not an unhandled rejection
    player.dispose();
    element.remove();
    promises.push(player.setFrame(3), player.open({ url: "stream.quarc" }));
    const describe = ({ fault }: StreamError): string[] => [fault.kind, fault.message];
    return Promise.all(promises.map((promise) => promise.catch(describe)));
  });
  const disposed = ["player", "the player was disposed"];
  assert.deepEqual(messages, [null, disposed, disposed, disposed, disposed]); // null: no stream was open
});

browserTest("a seek and the seeks that it replaces resolve when its frame is shown", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  const shown = await page.run(async (player) => {
    const first = [await player.setFrame(7), player.frame];
    const next = [await player.step(), await player.step(-1), await player.seek(0.5)];
    const replacedResults = await Promise.all([player.setFrame(3), player.setFrame(20), player.setFrame(9)]);
    return { first, next, last: replacedResults.at(-1), frame: player.frame };
  });
  assert.deepEqual(shown, { first: [7, 7], next: [8, 7, 15], last: 9, frame: 9 });
});

browserTest("frame is the ordinal of the frame on the screen, also after a seek has begun", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil(({ frame, player }) => frame === 0 && (player?.bufferedTo ?? 0) > 1);
  const shown = await page.run(async (player) => {
    const frames: (number | null)[][] = [];
    player.addEventListener("frame", ({ detail }) => frames.push([detail.frame, player.frame]));
    void player.step(); // frame 1 is still being sorted when the seek begins
    await player.setFrame(20);
    return frames;
  });
  assert.deepEqual(shown, [[1, 1], [20, 20]]);
});

browserTest("a seek and the opening of a stream survive the loss of the graphics context", async () => {
  await using page = await PlayerPage.open({ bitsPerSecond: 400_000 });
  await page.waitUntil((player) => player.frame === 0);
  const frames = await page.run(async (player) => {
    const canvas = player.shadowRoot?.querySelector("canvas");
    const extension = canvas?.getContext("webgl2")?.getExtension("WEBGL_lose_context");
    const loseContext = (whileLost: () => void): Promise<void> => {
      const restored = new Promise<void>((resolve) => {
        canvas?.addEventListener("webglcontextrestored", () => resolve(), { once: true });
      });
      extension?.loseContext();
      setTimeout(whileLost, 50);
      setTimeout(() => extension?.restoreContext(), 500);
      return restored;
    };
    const seek = player.setFrame(20);
    await loseContext(() => undefined);
    const seekResult = await seek;
    // Frame 20 may be drawn once more before the stream is opened again.
    const shown = new Promise<void>((resolve) => {
      player.addEventListener("frame", () => player.frame === 0 && resolve());
    });
    await loseContext(() => player.setAttribute("src", "stream.quarc"));
    await shown;
    return [seekResult, await player.setFrame(3)];
  });
  assert.deepEqual(frames, [20, 3]);
});

browserTest("a seek to a damaged frame rejects with the reject id", async () => {
  const stream = readRoom().slice();
  stream[stream.length - 4000] = stream[stream.length - 4000]! ^ 0xff;
  await using page = await PlayerPage.open({ stream });
  await page.waitUntil((player) => player.frame === 0);
  const rejectId = await page.run((player) =>
    player.setFrame(23).then(
      () => null,
      ({ fault }: StreamError) => fault.rejectId,
    ),
  );
  assert.equal(rejectId, "payload-crc");
});

browserTest("a step to a damaged frame rejects, and steps back go to the frames before the shown frame", async () => {
  const stream = readRoom().slice();
  stream[stream.length >> 1]! ^= 1;
  await using page = await PlayerPage.open({ stream });
  await page.waitUntil((player) => player.frame === 0);
  const [failure, shown, back] = await page.run(async (player) => {
    const describe = ({ fault }: StreamError): (string | number | null)[] => [fault.rejectId, fault.frame];
    let failure: unknown = 0;
    while (typeof failure === "number") failure = await player.step(1).catch(describe);
    return [failure, player.frame, [await player.step(-1), await player.step(-1)]];
  });
  assert.deepEqual([failure, shown, back], [["payload-crc", 12], 11, [10, 9]]);
});

browserTest("scrubbing shows intermediate pictures, and ends at the last position", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  const shown = await page.run(async (player) => {
    const frames: (number | null)[] = [];
    player.addEventListener("frame", () => frames.push(player.frame));
    for (let frame = 1; frame < 23; frame++) {
      player.setFrame(frame);
      await new Promise((resolve) => setTimeout(resolve, 20));
    }
    player.setFrame(22);
    while (player.frame !== 22) await new Promise((resolve) => setTimeout(resolve, 20));
    return frames;
  });
  assert.ok(shown.length >= 2, `${shown}`);
  assert.equal(shown.at(-1), 22);
});
