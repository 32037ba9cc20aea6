/** Opening streams by the element and by programs: addresses, bytes, first frames and cameras. */

import assert from "node:assert/strict";
import { KEEP_AUDIO, makeWav } from "./audio-file.js";
import { browserTest, PlayerPage, type PlayerElement } from "./browser.js";
import type { StreamError } from "../src/stream-error.js";
import { readVector } from "./server.js";

declare const audioElement: HTMLAudioElement; // on the page

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

browserTest("an empty src opens nothing", async () => {
  await using page = await PlayerPage.open({ attributes: null });
  const errors = await page.page.evaluate(async () => {
    const [empty, full] = ["", "stream.quarc"].map((src) => {
      const player = document.createElement("quarc-player");
      player.setAttribute("src", src);
      return document.body.appendChild(player);
    });
    const errors: unknown[] = [];
    empty?.addEventListener("error", ({ detail }) => errors.push(detail));
    await new Promise((resolve) => full?.addEventListener("frame", resolve, { once: true }));
    return errors;
  });
  assert.deepEqual(errors, []);
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

browserTest("an element that is given bytes for the second time keeps its stream, and can be moved", async () => {
  await using page = await PlayerPage.open({ attributes: 'poster="data:image/gif;base64,R0lGODlhAQABAAAAACw="' });
  await page.waitUntil((player) => player.frame === 0);
  const results = await page.run(async (player) => {
    const bytes = await (await fetch("stream.quarc")).arrayBuffer();
    structuredClone(bytes, { transfer: [bytes] });
    player.lookThrough("side");
    let error = null;
    try {
      player.open({ bytes });
    } catch (thrown) {
      error = (thrown as Error).name;
    }
    const poster = player.shadowRoot?.querySelector<HTMLElement>(".poster");
    const states = [error, poster?.hidden, player.player?.camera, await player.setFrame(5)];
    const shown = new Promise<number>((resolve) => {
      player.addEventListener("frame", ({ detail }) => resolve(detail.frame), { once: true });
    });
    document.body.append(player); // opens its src
    return [...states, await shown];
  });
  assert.deepEqual(results, ["DataCloneError", true, "side", 5, 0]);
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

browserTest("a canvas whose context was released cannot get another player", async () => {
  await using page = await PlayerPage.open({ attributes: null });
  const error = await page.page.evaluate(async () => {
    const { Player, DrawingError } = await import(`${location.origin}/quarc-player.js`);
    const canvas = document.createElement("canvas");
    new Player(canvas).dispose(); // the canvas is not on the page
    document.body.append(canvas);
    try {
      return String(new Player(canvas));
    } catch (error) {
      return `${error instanceof DrawingError}: ${(error as Error).message}`;
    }
  });
  assert.equal(error, "true: the graphics context of this canvas was released by dispose()");
});

browserTest("a canvas with another context is not taken for a browser without WebGL2", async () => {
  await using page = await PlayerPage.open({ attributes: null });
  const errors = await page.page.evaluate(async () => {
    const { Player, DrawingError } = await import(`${location.origin}/quarc-player.js`);
    return ["2d", "webgl"].map((kind) => {
      const canvas = document.createElement("canvas");
      canvas.getContext(kind);
      try {
        return String(new Player(canvas));
      } catch (error) {
        return `${error instanceof DrawingError}: ${(error as Error).message}`;
      }
    });
  });
  for (const error of errors) assert.equal(error, "true: this canvas already has a context that is not WebGL2");
});

browserTest("a canvas has at most one player at a time", async () => {
  await using page = await PlayerPage.open({ attributes: null });
  const [error, isLost, frame] = await page.page.evaluate(async () => {
    const { Player, DrawingError } = await import(`${location.origin}/quarc-player.js`);
    const canvas = document.body.appendChild(document.createElement("canvas"));
    const first = new Player(canvas);
    let error = null;
    try {
      new Player(canvas);
    } catch (thrown) {
      error = `${thrown instanceof DrawingError}: ${(thrown as Error).message}`;
    }
    first.dispose();
    const player = new Player(canvas);
    await player.open({ url: "stream.quarc" });
    canvas.remove();
    first.dispose(); // does nothing, so the second player keeps its context
    return [error, canvas.getContext("webgl2")?.isContextLost(), await player.setFrame(3)];
  });
  assert.equal(error, "true: this canvas has a player already: call its method dispose() first");
  assert.deepEqual([isLost, frame], [false, 3]);
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

browserTest("a stream that begins at frame 7 begins at second 0, at the left of the slider, and within its audio", async () => {
  const [stream, files] = [readVector("streams/seek-outside"), { "/sound.wav": makeWav(5) }];
  await using page = await PlayerPage.open({ stream, files, attributes: 'audio="sound.wav" audio-start="1"', initScript: KEEP_AUDIO });
  await page.waitUntil(({ frame, info }) => frame === 7 && info?.frameCount === 2);
  const state = await page.run(async (element) => {
    const player = element.player!;
    const rate = player.info!.timescale / player.info!.frameTicks;
    const audioFrame = Math.round((audioElement.currentTime - 1) * rate);
    const times = [player.currentTime, player.duration! * rate, await player.seek(1 / rate), player.currentTime * rate];
    element.shadowRoot!.querySelector("canvas")!.dispatchEvent(new KeyboardEvent("keydown", { key: "Home", bubbles: true }));
    while (player.frame !== 7) await new Promise((resolve) => player.addEventListener("frame", resolve, { once: true }));
    await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
    const { min, max, value } = element.shadowRoot!.querySelector("input")!;
    return { audioFrame, times: times.map((time) => Math.round(1e6 * time!) / 1e6), slider: [min, max, value] };
  });
  assert.deepEqual(state, { audioFrame: 7, times: [0, 2, 8, 1], slider: ["7", "8", "7"] });
});

browserTest("the statistics of a stream end when another is opened", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  const statistics = await page.run((player) => {
    const before = player.statistics?.gaussians ?? 0;
    player.setAttribute("src", "stream.quarc?2");
    return [before > 0, player.statistics];
  });
  assert.deepEqual(statistics, [true, null]);
});
