/** The decode service: allowed frames, quick seeks, memory. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { DecodeService } from "../src/decode/decode-service.js";
import type { DecodeReply, FramePacket } from "../src/protocol.js";
import { FrameRebuilder } from "./frame-rebuilder.js";
import { readVector, StreamServer } from "./server.js";

const LAP_COUNT = 120; // each of nine frames

/** Stores the replies of a decode service, and waits for conditions on them. */
class ReplyRecorder {
  readonly replies: DecodeReply[] = [];
  readonly decoding = new DecodeService((reply) => {
    this.replies.push(reply);
    this.#checkCondition();
  });
  #checkCondition = (): void => undefined;

  get frames(): FramePacket[] {
    return this.replies.flatMap((reply) => (reply.kind === "frame" ? [reply.packet] : []));
  }

  async waitUntil(condition: () => boolean): Promise<void> {
    await new Promise<void>((resolve) => {
      this.#checkCondition = () => (condition() ? resolve() : undefined);
      this.#checkCondition();
    });
  }

  hasReply(kind: DecodeReply["kind"], run: number): boolean {
    return this.replies.some((reply) => reply.kind === kind && "run" in reply && reply.run === run);
  }

  open(name: string): void {
    const bytes = Uint8Array.from(readVector(`streams/${name}`)).buffer;
    this.decoding.handle({ kind: "open", source: { bytes }, run: 0 });
  }
}

const sleep = (milliseconds: number): Promise<void> =>
  new Promise((resolve) => setTimeout(resolve, milliseconds));

test("a decoder that cannot be loaded is reported, and is loaded again for the next stream", async (context) => {
  const { instantiate } = WebAssembly;
  const failToLoad = (module: WebAssembly.Module, imports: WebAssembly.Imports): Promise<WebAssembly.Instance> => {
    // Node's fetch loads a module of its own, which has imports.
    if (Object.keys(imports).length > 0) return instantiate(module, imports);
    return Promise.reject(new RangeError("out of memory"));
  };
  const mock = context.mock.method(WebAssembly, "instantiate", failToLoad as typeof instantiate);
  const recorder = new ReplyRecorder();
  recorder.open("journey");
  await recorder.waitUntil(() => recorder.hasReply("error", 0));
  const faults = recorder.replies.flatMap((reply) => (reply.kind === "error" ? [reply.error] : []));
  assert.deepEqual(
    faults.map(({ kind, rejectId, message }) => [kind, rejectId, message]),
    [["limit", null, "the decoder cannot be loaded: RangeError: out of memory"]],
  );
  mock.mock.restore();
  recorder.open("journey");
  recorder.decoding.handle({ kind: "more", frames: 1, run: 0 });
  await recorder.waitUntil(() => recorder.frames.length === 1);
});

test("only the allowed number of frames is sent", async () => {
  const recorder = new ReplyRecorder();
  recorder.open("journey");
  recorder.decoding.handle({ kind: "more", frames: 2, run: 0 });
  await recorder.waitUntil(() => recorder.frames.length === 2);
  await sleep(100);
  assert.deepEqual(recorder.frames.map(({ frame }) => frame), [0, 1]);
  recorder.decoding.handle({ kind: "more", frames: 3, run: 0 });
  await recorder.waitUntil(() => recorder.frames.length === 5);
  await sleep(100);
  assert.equal(recorder.frames.length, 5);
  recorder.decoding.handle({ kind: "close" });
});

test("after several quick seeks, only the last seek is completed", async () => {
  const recorder = new ReplyRecorder();
  recorder.open("journey");
  for (let run = 1; run <= 20; run++) {
    recorder.decoding.handle({ kind: "seek", frame: (3 * run) % 9, run });
    recorder.decoding.handle({ kind: "more", frames: 9, run });
  }
  recorder.decoding.handle({ kind: "seek", frame: 5, run: 21 });
  recorder.decoding.handle({ kind: "more", frames: 9, run: 21 });
  await recorder.waitUntil(() => recorder.hasReply("end", 21));
  const frames = recorder.frames.filter(({ run }) => run === 21);
  assert.deepEqual(frames.map(({ frame }) => frame), [5, 6, 7, 8]);
  assert.deepEqual(frames.map(({ isFull }) => isFull), [true, false, false, false]);
});

test("playing a stream repeatedly gives the same frames and does not increase memory", async () => {
  const recorder = new ReplyRecorder();
  recorder.open("snapshots-updates");
  recorder.decoding.handle({ kind: "more", frames: 100, run: 0 });
  await recorder.waitUntil(() => recorder.hasReply("end", 0));
  const playLap = async (run: number): Promise<string> => {
    recorder.replies.length = 0;
    recorder.decoding.handle({ kind: "seek", frame: 0, run });
    recorder.decoding.handle({ kind: "more", frames: 100, run });
    await recorder.waitUntil(() => recorder.hasReply("end", run));
    const rebuilt = new FrameRebuilder();
    return recorder.frames.map((packet) => rebuilt.apply(packet)).join();
  };
  const expectedDigests = await playLap(1);
  const measureMiB = (): number => process.memoryUsage().rss / 2 ** 20;
  let settledMiB = 0;
  for (let run = 2; run < LAP_COUNT; run++) {
    assert.equal(await playLap(run), expectedDigests);
    if (run === LAP_COUNT >> 1) settledMiB = measureMiB();
  }
  assert.ok(measureMiB() < settledMiB + 32, `memory grew from ${settledMiB.toFixed()} MiB to ${measureMiB().toFixed()} MiB`);
});

test("cameras and metadata after the first frame change the description", async () => {
  const recorder = new ReplyRecorder();
  recorder.open("cameras-and-metadata");
  recorder.decoding.handle({ kind: "more", frames: 9, run: 0 });
  await recorder.waitUntil(() => recorder.hasReply("end", 0));
  const listInfos = () =>
    recorder.replies.flatMap((reply) =>
      reply.kind === "info" ? [[reply.info.cameras.map(({ name }) => name), Object.keys(reply.info.metadata)]] : [],
    );
  const expectedInfos = [
    [["left", "left"], []],
    [[], ["title", ""]], // an empty chunk `came` before the second frame
    [["left"], ["title", ""]], // chunks after the last frame
  ];
  assert.deepEqual(listInfos(), expectedInfos);
  for (const run of [1, 2]) {
    recorder.decoding.handle({ kind: "seek", frame: run - 1, run });
    recorder.decoding.handle({ kind: "more", frames: 9, run });
    await recorder.waitUntil(() => recorder.hasReply("end", run));
  }
  assert.deepEqual(listInfos(), expectedInfos, "the description has not changed since then");
});

test("a seek does not request available bytes", async () => {
  await using server = await StreamServer.start(readVector("streams/journey"));
  const recorder = new ReplyRecorder();
  recorder.decoding.handle({ kind: "open", source: { url: server.url }, run: 0 });
  recorder.decoding.handle({ kind: "more", frames: 1, run: 0 });
  await recorder.waitUntil(() => recorder.frames.length === 1);
  const requestCount = server.requests.length;
  recorder.decoding.handle({ kind: "seek", frame: 7, run: 1 });
  recorder.decoding.handle({ kind: "more", frames: 9, run: 1 });
  await recorder.waitUntil(() => recorder.hasReply("end", 1));
  assert.deepEqual(recorder.frames.map(({ frame }) => frame), [0, 7, 8]);
  assert.equal(server.requests.length, requestCount, "the whole stream has already been received");
});

test("a seek past the end of a stream that begins at frame 7 goes to its last frame, with and without the index", async () => {
  for (const supportsRanges of [true, false]) { // without, the index cannot be read before the frames
    await using server = await StreamServer.start(readVector("streams/seek-outside"), { supportsRanges });
    const recorder = new ReplyRecorder();
    recorder.decoding.handle({ kind: "open", source: { url: server.url }, run: 0 });
    recorder.decoding.handle({ kind: "more", frames: 1, run: 0 });
    await recorder.waitUntil(() => recorder.frames.length === 1);
    recorder.decoding.handle({ kind: "seek", frame: Infinity, run: 1, clampToLast: true });
    recorder.decoding.handle({ kind: "more", frames: 9, run: 1 });
    await recorder.waitUntil(() => recorder.hasReply("end", 1));
    recorder.decoding.handle({ kind: "close" });
    assert.deepEqual(recorder.frames.map(({ frame }) => frame), [7, 8]);
    const ends = recorder.replies.flatMap((reply) => (reply.kind === "end" ? [reply.frameCount] : []));
    assert.deepEqual(ends, [2]);
  }
});

test("a frame has the bytes and the decode time of its own; after a seek, the bytes are unknown", async (context) => {
  let time = 0;
  context.mock.method(performance, "now", () => ++time);
  const recorder = new ReplyRecorder();
  recorder.open("journey-without-index");
  recorder.decoding.handle({ kind: "more", frames: 9, run: 0 });
  await recorder.waitUntil(() => recorder.frames.length === 9);
  const { frames } = recorder;
  const tailBytes = 40;
  assert.equal(frames.reduce((sum, { bytes }) => sum + (bytes ?? NaN), 0), readVector("streams/journey-without-index").length - tailBytes);
  assert.equal(frames[1]?.decodeMs, 2); // between two reads of the clock each: decoding, and making the packet
  assert.equal(frames[8]?.decodeMs, 2);
  recorder.decoding.handle({ kind: "seek", frame: 4, run: 1 });
  recorder.decoding.handle({ kind: "more", frames: 2, run: 1 });
  await recorder.waitUntil(() => recorder.frames.length === 11);
  assert.deepEqual(recorder.frames.slice(9).map(({ bytes }) => bytes), [null, frames[5]?.bytes]);
});

test("the description is posted again only when it has changed", async () => {
  const recorder = new ReplyRecorder();
  recorder.open("journey"); // has metadata after frame 3
  recorder.decoding.handle({ kind: "more", frames: 10, run: 0 }); // the end takes the place of a frame
  await recorder.waitUntil(() => recorder.hasReply("end", 0));
  const infos = recorder.replies.flatMap((reply) => (reply.kind === "info" ? [reply.info] : []));
  assert.equal(new Set(infos.map((info) => JSON.stringify(info))).size, infos.length);
  assert.deepEqual([infos[0]?.frameCount, infos.at(-1)?.frameCount], [null, 9]);
});
