/** The component with servers and streams that have faults. */

import assert from "node:assert/strict";
import { browserTest, PlayerPage, type PlayerElement } from "./browser.js";
import type { PlayerFault } from "../src/protocol.js";
import type { StreamError } from "../src/stream-error.js";
import { readRoom, readVector, StreamServer } from "./server.js";

const CANONICAL_BYTES = 30_000; // approximate size of the first frame of room.quarc

const readText = (page: PlayerPage, selector: string): Promise<string> =>
  page.page.locator("quarc-player").locator(selector).innerText();

/** Open the stream again, and wait for the next error, because the first error may be missed. Runs on the page. */
function nextFault(player: PlayerElement): Promise<{ kind: string; rejectId: string | null; frame: number | null }> {
  return new Promise((resolve) => {
    player.addEventListener("error", ({ detail }) => resolve(detail), { once: true });
    player.setAttribute("src", "stream.quarc");
  });
}

for (const supportsRanges of [true, false]) {
  browserTest(`a short stream is requested only once, even for seeks, ${supportsRanges ? "with" : "without"} range requests`, async () => {
    await using page = await PlayerPage.open({ supportsRanges, bitsPerSecond: 400_000 });
    await page.waitUntil((player) => player.frame === 0);
    for (const frame of [20, 2, 0]) await page.setFrame(frame);
    assert.deepEqual(page.server.requests, ["bytes=0-"]);
  });
}

browserTest("without range requests, a seek to a frame that has arrived does not wait for the rest of the stream", async () => {
  await using page = await PlayerPage.open({ supportsRanges: false, heldFrom: readRoom().length >> 1 });
  await page.waitUntil((player) => player.frame === 0);
  for (const frame of [9, 3]) await page.setFrame(frame);
});

browserTest("a stream is shown from a server that compresses it, although browsers reject that in answers to range requests", async () => {
  await using page = await PlayerPage.open({ compresses: true, expectedErrors: /ERR_CONTENT_DECODING_FAILED/ });
  for (const frame of [20, 2]) {
    await page.waitUntil((player) => player.frame !== null);
    await page.setFrame(frame);
  }
  assert.deepEqual(page.server.requests, ["bytes=0-", "", "bytes=0-"]); // the last confirms that only ranges fail
});

browserTest("the length of a compressed response is not the size of the stream, also on another origin", async () => {
  const stream = readRoom();
  await using server = await StreamServer.start(stream, { allowsOrigins: true, compresses: true });
  await using page = await PlayerPage.open({ attributes: null, expectedErrors: /ERR_CONTENT_DECODING_FAILED/ });
  const [frame, sizes] = await page.page.evaluate(async (url) => {
    const { Player } = await import(`${location.origin}/quarc-player.js`);
    const player = new Player(document.body.appendChild(document.createElement("canvas")));
    const sizes = new Set<number | null>();
    player.addEventListener("progress", ({ detail }: CustomEvent<{ byteLength: number | null }>) => sizes.add(detail.byteLength));
    await player.open({ url });
    return [await player.setFrame(23), [...sizes]];
  }, server.url);
  assert.equal(frame, 23);
  assert.ok(sizes.every((size) => size === null || size === stream.length), String(sizes));
});

browserTest("a missing stream is reported, and can be retried", async () => {
  await using page = await PlayerPage.open({ status: 404, attributes: 'frame="4"', expectedErrors: /404/ });
  await page.page.locator("quarc-player .fault h2").waitFor();
  assert.equal(await readText(page, ".fault h2"), "The stream cannot be loaded");
  assert.match(await readText(page, ".fault p"), /stream\.quarc: the server answered 404/);
  page.server.setOptions({ status: null });
  await page.page.locator("quarc-player .fault button").click();
  await page.waitUntil((player) => player.frame === 4);
  assert.equal(await page.page.locator("quarc-player .fault").isVisible(), false);
  assert.equal(await page.run((player) => player.isPlaying), false);
});

browserTest("playback that an error has stopped continues when the stream is loaded again", async () => {
  await using page = await PlayerPage.open({ status: 404, attributes: "autoplay loop", expectedErrors: /404/ });
  await page.page.locator("quarc-player .fault h2").waitFor();
  page.server.setOptions({ status: null });
  await page.page.locator("quarc-player .fault button").click();
  await page.waitUntil((player) => player.isPlaying && (player.frame ?? 0) > 2);
});

browserTest("after a connection breaks, the missing bytes are requested", async () => {
  await using page = await PlayerPage.open({
    breakAfterBytes: 20_000,
    attributes: 'autoplay speed="8"',
    expectedErrors: /ERR_(CONTENT_LENGTH_MISMATCH|INCOMPLETE_CHUNKED_ENCODING|CONNECTION_RESET)/,
  });
  await page.waitUntil((player) => player.frame === 23);
  assert.ok(page.server.requests.length > 3);
});

browserTest("a file that is replaced is reported as a network error, and can be opened again", async () => {
  await using page = await PlayerPage.open({
    ...{ breakAfterBytes: 40_000, heldFrom: 35_000 }, // the second request comes after the file has been replaced
    expectedErrors: /ERR_(CONTENT_LENGTH_MISMATCH|INCOMPLETE_CHUNKED_ENCODING|CONNECTION_RESET)/,
  });
  await page.waitUntil((player) => player.frame === 0);
  const failed = page.run(({ player }) => player?.setFrame(23).catch(({ fault }: StreamError) => fault.message));
  page.server.grow(readVector("streams/journey"));
  page.server.setOptions({ breakAfterBytes: Infinity, heldFrom: Infinity });
  assert.match(String(await failed), /stream\.quarc: the file on the server has changed$/);
  assert.equal(await readText(page, ".fault h2"), "The stream cannot be loaded");
  await page.page.locator("quarc-player .fault button").click();
  await page.waitUntil((player) => player.frame === 8 && player.info?.frameCount === 9);
});

browserTest("a damaged stream plays up to the damage, and shows the reject id", async () => {
  const stream = Uint8Array.from(readRoom());
  stream[stream.length >> 1] = (stream[stream.length >> 1] ?? 0) ^ 1;
  await using page = await PlayerPage.open({ stream, attributes: 'autoplay speed="8"' });
  const fault = await page.run(nextFault);
  assert.deepEqual([fault.kind, fault.rejectId], ["rejected", "payload-crc"]);
  assert.ok((fault.frame ?? 0) > 0);
  assert.equal(await page.run((player) => player.frame), (fault.frame ?? 0) - 1);
  await page.page.waitForTimeout(200);
  assert.ok(await page.page.locator("quarc-player .fault").isVisible());
  assert.equal(await page.run(({ player }) => player?.isWaiting), false);
  assert.equal(await readText(page, ".fault h2"), "This stream is damaged");
  assert.match(await readText(page, ".fault code"), /payload-crc/);
});

browserTest("a truncated stream plays up to its end, and is reported as truncated", async () => {
  const stream = readRoom();
  await using page = await PlayerPage.open({ stream: stream.subarray(0, stream.length - 100), attributes: 'autoplay speed="8"' });
  const fault = await page.run(nextFault);
  assert.deepEqual([fault.kind, fault.rejectId], ["rejected", "truncated"]);
  await page.waitUntil((player) => (player.frame ?? -1) >= 0);
});

browserTest("an empty file is rejected as truncated", async () => {
  await using page = await PlayerPage.open({ stream: new Uint8Array(0), expectedErrors: /416/ });
  const fault = await page.run(nextFault);
  assert.deepEqual([fault.kind, fault.rejectId], ["rejected", "truncated"]);
});

browserTest("a file that is not a stream is rejected with bad-magic", async () => {
  await using page = await PlayerPage.open({ stream: new TextEncoder().encode("<!doctype html>") });
  const fault = await page.run(nextFault);
  assert.deepEqual([fault.kind, fault.rejectId], ["rejected", "bad-magic"]);
});

browserTest("a stream without frames is reported", async () => {
  for (const name of ["no-frames", "no-frames-index"]) {
    await using page = await PlayerPage.open({ stream: readVector(`streams/${name}`), attributes: "autoplay" });
    const fault = await page.run(nextFault);
    assert.equal(fault.kind, "empty");
    assert.equal(await readText(page, ".fault p"), "the stream has no frames");
    const state = await page.run(({ player }) => [player?.isPlaying, player?.isWaiting]);
    assert.deepEqual(state, [false, false]);
  }
});

browserTest("a picture is shown before the first frame has arrived", async () => {
  await using page = await PlayerPage.open({ heldFrom: CANONICAL_BYTES * 0.75, attributes: null });
  await page.page.evaluate(async () => {
    const player = document.createElement("quarc-player") as PlayerElement;
    player.setAttribute("src", "stream.quarc");
    const previewed = new Promise((resolve) => player.addEventListener("preview", resolve, { once: true }));
    document.body.append(player);
    await previewed;
  });
  const [red, green, blue] = (await page.takeScreenshot()).pixelAt(120, 220); // not on the waiting indicator
  assert.ok(red + green + blue > 60, "the canvas is black");
  assert.equal(await page.run((player) => player.frame), null);
  page.server.setOptions({ heldFrom: Infinity });
  await page.waitUntil((player) => player.frame === 0);
});

browserTest("a stream that is too large for the graphics card is reported", async () => {
  await using page = await PlayerPage.open({ attributes: null });
  const shown = await page.page.evaluate(async () => {
    const { getParameter } = WebGL2RenderingContext.prototype;
    WebGL2RenderingContext.prototype.getParameter = function (name: GLenum) {
      return name === this.MAX_TEXTURE_SIZE ? 4 : getParameter.call(this, name);
    };
    const player = document.createElement("quarc-player") as PlayerElement;
    player.setAttribute("src", "stream.quarc");
    const failed = new Promise<string>((resolve) => player.addEventListener("error", ({ detail }) => resolve(detail.kind)));
    document.body.append(player);
    const kind = await failed;
    await new Promise((resolve) => setTimeout(resolve, 200));
    return [kind, player.frame];
  });
  assert.deepEqual(shown, ["limit", null]);
  assert.ok(await page.page.locator("quarc-player .fault").isVisible());
});

browserTest("a failure of the sort worker is reported", async () => {
  await using page = await PlayerPage.open({ attributes: null });
  const fault = await page.page.evaluate(async () => {
    const { postMessage } = Worker.prototype;
    Worker.prototype.postMessage = function (request: { kind: string }, ...rest: unknown[]) {
      if (request.kind !== "frame") return Reflect.apply(postMessage, this, [request, ...rest]);
      setTimeout(() => this.dispatchEvent(new ErrorEvent("error", { message: "allocation failed" })));
    };
    const player = document.createElement("quarc-player") as PlayerElement;
    player.setAttribute("src", "stream.quarc");
    const failed = new Promise<PlayerFault>((resolve) => player.addEventListener("error", ({ detail }) => resolve(detail)));
    document.body.append(player);
    return failed;
  });
  assert.deepEqual([fault.kind, fault.message], ["limit", "allocation failed"]);
});

browserTest("shaders that do not compile are reported, also after the graphics context was lost", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  const faults = await page.run(async (element) => {
    const { Player } = await import(`${location.origin}/quarc-player.js`);
    const { getShaderParameter } = WebGL2RenderingContext.prototype;
    WebGL2RenderingContext.prototype.getShaderParameter = function (shader: WebGLShader, name: GLenum) {
      return name === this.COMPILE_STATUS ? false : getShaderParameter.call(this, shader, name);
    };
    const player = new Player(document.body.appendChild(document.createElement("canvas")));
    const faults: PlayerFault[] = [];
    player.addEventListener("error", ({ detail }: CustomEvent<PlayerFault>) => faults.push(detail));
    const recordFault = ({ fault }: StreamError): unknown => faults.push(fault);
    await player.open({ url: "stream.quarc" }).catch(recordFault);
    await player.setFrame(3).catch(recordFault);
    const failed = new Promise<PlayerFault>((resolve) => {
      element.addEventListener("error", ({ detail }) => resolve(detail), { once: true });
    });
    const context = element.shadowRoot?.querySelector<HTMLCanvasElement>("canvas.view")?.getContext("webgl2");
    const extension = context?.getExtension("WEBGL_lose_context");
    extension?.loseContext();
    setTimeout(() => extension?.restoreContext(), 200);
    return [...faults, await failed].map(({ kind, message }) => `${kind}: ${message}`);
  });
  assert.equal(faults.length, 5); // an event and a rejection of both promises, and an event after the loss
  for (const fault of faults) assert.match(fault, /^limit: a shader does not compile/);
});

browserTest("the picture stays while another stream is loading, even if the page is resized", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  page.server.setOptions({ bitsPerSecond: 100_000 });
  await page.run((player) => {
    const begun = new Promise((resolve) => player.addEventListener("info", resolve, { once: true }));
    player.setAttribute("frame", "15");
    player.setAttribute("src", "stream.quarc");
    return begun.then(() => undefined);
  });
  for (const width of [480, 400]) {
    await page.page.setViewportSize({ width, height: 400 });
    await page.page.evaluate("new Promise((resolve) => setTimeout(resolve, 100))");
    const [red, green, blue] = (await page.takeScreenshot()).pixelAt(width / 4, 220); // not on the waiting indicator
    assert.equal(await page.run((player) => player.frame), null);
    assert.ok(red + green + blue > 60, `the canvas is black, ${width} pixels wide`);
  }
  await page.waitUntil((player) => player.frame === 15);
});

browserTest("a view that has been moved stays until the next stream is shown from its camera", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  const heldFrom = readRoom().length >> 3; // no preview yet
  page.server.setOptions({ heldFrom });
  const cameras = await page.run(async (player) => {
    player.flip();
    player.setAttribute("src", "stream.quarc");
    player.setAttribute("camera", "side");
    let moves = 0;
    player.addEventListener("view", () => (moves += 1), { once: true });
    await new Promise((resolve) => setTimeout(resolve, 200));
    return [moves, player.player?.camera];
  });
  assert.deepEqual(cameras, [0, null]);
  page.server.setOptions({ heldFrom: Infinity });
  await page.waitUntil(({ player }) => player?.frame === 0 && player.camera === "side");
});

browserTest("without WebGL2, an error is shown, and neither a worker nor a listener is left", async () => {
  await using page = await PlayerPage.open({ attributes: null });
  const counts = await page.page.evaluate(() => {
    HTMLCanvasElement.prototype.getContext = () => null;
    const [BrowserWorker, counts] = [Worker, { workers: 0, listeners: 0, errors: 0 }];
    window.addEventListener = () => (counts.listeners += 1);
    window.Worker = class extends BrowserWorker {
      constructor(url: string | URL) {
        super(url);
        counts.workers += 1;
      }
    };
    const player = document.createElement("quarc-player") as PlayerElement;
    player.addEventListener("error", () => (counts.errors += 1));
    document.body.append(player);
    return counts;
  });
  assert.deepEqual(counts, { workers: 0, listeners: 0, errors: 1 });
  assert.equal(await readText(page, "h2"), "This browser cannot play the stream");
  const [background, size] = await page.run((player) => [getComputedStyle(player).backgroundColor, player.clientHeight]);
  assert.deepEqual([background, size], ["rgb(13, 15, 18)", 400], "the style of the player is kept");
  const { x, width } = (await page.page.locator("quarc-player .fault div").boundingBox())!;
  assert.ok(Math.abs(x + width / 2 - 240) < 1, "the message is centered");
  assert.equal(await page.page.locator("quarc-player").locator("button, canvas").count(), 0);
});

browserTest("a server on another origin need not expose the header Content-Range", async () => {
  await using server = await StreamServer.start(readRoom(), { allowsOrigins: true });
  await using page = await PlayerPage.open({ attributes: null });
  await page.page.evaluate((url) => {
    const player = document.createElement("quarc-player");
    player.setAttribute("src", url);
    document.body.append(player);
  }, server.url);
  await page.waitUntil((player) => player.frame === 0 && player.info?.frameCount === 24);
  await page.setFrame(20);
});
