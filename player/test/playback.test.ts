/** Playback in a browser: seeks, steps, loops, and the start and end of a stream. */

import assert from "node:assert/strict";
import { browserTest, PlayerPage, type PlayerElement } from "./browser.js";
import type { StreamError } from "../src/stream-error.js";
import { readRoom, readVector } from "./server.js";

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

browserTest("opening at a frame shows no other frame before it", async () => {
  await using page = await PlayerPage.open({ attributes: null, bitsPerSecond: 1e6 });
  const shown = await page.page.evaluate(async () => {
    const player = document.createElement("quarc-player") as PlayerElement;
    const [frames, previews]: [(number | null)[], Event[]] = [[], []];
    player.addEventListener("frame", () => frames.push(player.frame));
    player.addEventListener("preview", (event) => previews.push(event));
    player.setAttribute("src", "stream.quarc");
    player.setAttribute("frame", "15");
    document.body.append(player);
    const isDone = (): boolean => frames.length > 0 && player.info?.frameCount === 24; // the index has been read
    while (!isDone()) await new Promise((resolve) => setTimeout(resolve, 20));
    const { cameras = [], metadata = {} } = player.info ?? {};
    return { frames, previews: previews.length, cameras: cameras.length, title: metadata["title"] };
  });
  assert.deepEqual(shown, { frames: [15], previews: 0, cameras: 3, title: "a ball in a room" });
});

browserTest("frameworks that set properties instead of attributes can set the first frame", async () => {
  await using page = await PlayerPage.open({ attributes: null });
  const frames = await page.page.evaluate(async () => {
    const player = document.createElement("quarc-player");
    player.setAttribute("src", "stream.quarc");
    for (const frame of [1, null, "15"]) player.frame = frame;
    const shown = new Promise<number>((resolve) => player.addEventListener("frame", ({ detail }) => resolve(detail.frame)));
    document.body.append(player);
    return [await shown, player.frame];
  });
  assert.deepEqual(frames, [15, 15]);
});

browserTest("cameras after the first frame replace the cameras, and the view if it has not been moved", async () => {
  for (const isMoved of [false, true]) {
    await using page = await PlayerPage.open({ stream: readVector("streams/cameras-and-metadata"), attributes: null });
    const cameras = await page.page.evaluate(async (isMoved) => {
      const { Player } = await import(`${location.origin}/quarc-player.js`);
      const player = new Player(document.body.appendChild(document.createElement("canvas")));
      const states: unknown[] = [];
      player.addEventListener("info", () => states.push([player.cameras.length, player.camera]));
      let isFirst = true;
      player.onDecoded(() => {
        if (isMoved && isFirst) player.flip();
        isFirst = false;
      });
      await player.open({ url: "stream.quarc" });
      await player.setFrame(1);
      while (states.length < 3) await new Promise((resolve) => setTimeout(resolve, 20));
      return states;
    }, isMoved);
    const camera = isMoved ? null : "left";
    assert.deepEqual(cameras, [[2, "left"], [2, camera], [1, camera]]);
  }
});

browserTest("an element that has opened bytes can be moved, and then opens its src", async () => {
  await using page = await PlayerPage.open({ attributes: null });
  const frames = await page.page.evaluate(async () => {
    const player = document.body.appendChild(document.createElement("quarc-player")) as PlayerElement;
    const nextFrame = (): Promise<number> =>
      new Promise((resolve) => player.addEventListener("frame", ({ detail }) => resolve(detail.frame), { once: true }));
    player.open({ bytes: await (await fetch("stream.quarc")).arrayBuffer() });
    const first = await nextFrame();
    document.body.append(player); // neither an error nor a stream
    const between = player.info;
    player.remove();
    player.open({ url: "missing.quarc" });
    player.setAttribute("src", "stream.quarc"); // replaces the source, although the element is not on the page
    document.body.append(player);
    return [first, between, await nextFrame()];
  });
  assert.deepEqual(frames, [0, null, 0]);
});

browserTest("bytes that were opened before are an error, after which the open stream still plays", async () => {
  await using page = await PlayerPage.open({ attributes: null });
  const results = await page.page.evaluate(async () => {
    const { Player } = await import(`${location.origin}/quarc-player.js`);
    const player = new Player(document.body.appendChild(document.createElement("canvas")));
    const bytes = await (await fetch("stream.quarc")).arrayBuffer();
    await player.open({ bytes });
    try {
      return [await player.open({ bytes })];
    } catch (error) {
      return [(error as Error).name, player.isWaiting, await player.setFrame(5)];
    }
  });
  assert.deepEqual(results, ["DataCloneError", false, 5]);
});

browserTest("programs can open relative addresses, like the attribute src", async () => {
  await using page = await PlayerPage.open({ attributes: null });
  const frames = await page.page.evaluate(async () => {
    const { Player, readFrames } = await import(`${location.origin}/quarc-player.js`);
    const base = document.head.appendChild(document.createElement("base"));
    base.href = "/folder/";
    const url = "../stream.quarc";
    const player = new Player(document.body.appendChild(document.createElement("canvas")));
    await player.open({ url });
    const element = document.body.appendChild(document.createElement("quarc-player")) as PlayerElement;
    element.open({ url });
    await new Promise((resolve) => element.addEventListener("frame", resolve, { once: true }));
    const { value } = await readFrames({ url }).next();
    return [player.frame, element.frame, value.frame];
  });
  assert.deepEqual(frames, [0, 0, 0]);
});

browserTest("an address that is invalid is a network error", async () => {
  await using page = await PlayerPage.open({ attributes: null });
  const kind = await page.page.evaluate(async () => {
    const { Player } = await import(`${location.origin}/quarc-player.js`);
    const player = new Player(document.body.appendChild(document.createElement("canvas")));
    return player.open({ url: "http://[" }).catch(({ fault }: StreamError) => fault.kind);
  });
  assert.equal(kind, "network");
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
    const shown = new Promise((resolve) => player.addEventListener("frame", resolve));
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

browserTest("a stream that replaces another also settles its promise, and shows no frame of it", async () => {
  await using page = await PlayerPage.open({ attributes: null });
  const [frames, titles] = await page.page.evaluate(async () => {
    const { Player } = await import(`${location.origin}/quarc-player.js`);
    const player = new Player(document.body.appendChild(document.createElement("canvas")));
    const url = `${location.origin}/stream.quarc`;
    const opened = [player.open({ url }, { frame: 5 })];
    const frames: number[] = [];
    player.addEventListener("frame", ({ detail }: CustomEvent<{ frame: number }>) => frames.push(detail.frame));
    let next = (): void => {
      next = (): void => undefined;
      queueMicrotask(() => opened.push(player.open({ url }))); // while the frame is being sorted
    };
    player.onDecoded(({ frame }: { frame: number }) => (frame === 5 ? next() : undefined));
    while (frames.length === 0) await new Promise((resolve) => setTimeout(resolve, 20));
    return [frames, (await Promise.all(opened)).map(({ metadata }) => metadata.title)];
  });
  assert.deepEqual([frames, titles], [[0], ["a ball in a room", "a ball in a room"]]);
});

browserTest("a program draws on its own canvas, and receives errors", async () => {
  await using page = await PlayerPage.open({ attributes: null, expectedErrors: /404/ });
  const picture = await page.page.evaluate(async () => {
    const { Player, StreamError } = await import(`${location.origin}/quarc-player.js`);
    const canvas = document.body.appendChild(document.createElement("canvas"));
    const nextDrawing = (): Promise<number> => new Promise((resolve) => requestAnimationFrame(resolve));
    const previous = new Player(canvas);
    await previous.open({ url: `${location.origin}/stream.quarc` });
    await nextDrawing();
    previous.dispose(); // another player can use the canvas
    const player = new Player(canvas);
    const info = await player.open({ url: `${location.origin}/stream.quarc` });
    previous.flip(); // draws nothing
    await nextDrawing();
    player.speed = 2;
    player.seek(0.5);
    while (player.frame !== 15) await new Promise((resolve) => setTimeout(resolve, 20));
    const { statistics, currentTime, duration, camera, cameras } = player;
    player.camera = "side";
    const names = [camera, player.camera, cameras.length];
    const fault = await player.open({ url: `${location.origin}/missing.quarc` }).catch((error: unknown) => {
      if (!(error instanceof StreamError)) throw error;
      return (error as { fault: unknown }).fault;
    });
    const laterStatistics = player.statistics; // not those of the stream before
    const lost = player.takePicture(cameras[0]).catch((error: Error) => error.name);
    player.dispose();
    player.dispose(); // does nothing
    const disposed = player.takePicture(cameras[0]).catch((error: Error) => error.name);
    const pictures = [await lost, await disposed];
    return { title: info.metadata.title, statistics, currentTime, duration, names, fault, laterStatistics, pictures };
  });
  assert.equal(picture.title, "a ball in a room");
  assert.deepEqual([picture.currentTime, picture.duration], [0.5, 0.8]);
  assert.deepEqual(picture.names, ["front", "side", 3]);
  const { gaussians, bufferedFrames, decodeMs, sortMs, receivedBytes, frameBytes } = picture.statistics;
  assert.ok(gaussians > 3000 && bufferedFrames >= 0 && decodeMs > 0 && sortMs > 0);
  assert.ok(receivedBytes > 60_000);
  assert.equal(frameBytes, null, "the size is unknown directly after a seek");
  assert.deepEqual([picture.fault.kind, picture.fault.rejectId], ["network", null]);
  assert.deepEqual(picture.pictures, ["DrawingError", "DrawingError"]);
  assert.equal(picture.laterStatistics, null);
});
