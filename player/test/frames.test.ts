/** Packets reproduce the states of the decoder, for streams in memory and from a server. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { DecodeService } from "../src/decode/decode-service.js";
import { readFrames } from "../src/decode/index.js";
import type { DecodeReply, FramePacket, StreamInfo, StreamSource } from "../src/protocol.js";
import { decodeDirectly, expectFault, mapStates, readSource } from "./decoded-frames.js";
import { readVector, StreamServer } from "./server.js";

const STREAMS = ["journey", "births-and-deaths", "snapshots-journey", "updates-journey", "sh-degree-0"];

const makeMemorySource = (stream: Uint8Array): StreamSource => ({ bytes: Uint8Array.from(stream).buffer });

for (const name of STREAMS) {
  test(`${name}: packets reproduce the state of every frame`, async () => {
    const stream = readVector(`streams/${name}`);
    const expectedFrames = await decodeDirectly(stream);
    assert.ok(expectedFrames.length > 0);
    assert.deepEqual(await readSource(makeMemorySource(stream)), expectedFrames);
  });

  test(`${name}: a seek gives the same frames as playing`, async () => {
    const stream = readVector(`streams/${name}`);
    const expectedFrames = await decodeDirectly(stream);
    await using server = await StreamServer.start(stream);
    for (let startFrame = 1; startFrame < expectedFrames.length; startFrame++) {
      const remainingFrames = expectedFrames.filter(({ frame }) => frame >= startFrame);
      assert.deepEqual(await readSource({ url: server.url }, startFrame), remainingFrames, `from ${startFrame}`);
    }
  });
}

test("frames begin at the first ordinal that is not less than `from`, which may be past the end", async () => {
  const stream = readVector("streams/journey");
  const readFrom = async (from: number): Promise<number[]> =>
    (await readSource(makeMemorySource(stream), from)).map(({ frame }) => frame);
  assert.deepEqual(await readFrom(-5), [0, 1, 2, 3, 4, 5, 6, 7, 8]);
  assert.deepEqual(await readFrom(6.5), [7, 8]);
  for (const from of [9, 2 ** 32, 2 ** 32 + 3, Infinity]) assert.deepEqual(await readFrom(from), [], `from ${from}`);
  await assert.rejects(readFrom(NaN), RangeError);
});

test("packets list the slots of births", async () => {
  const stream = readVector("streams/births-and-deaths");
  const ids = await mapStates(stream, (state) => new Set(state.ids));
  const birthCounts = ids.map((frameIds, frame) => [...frameIds].filter((id) => frame > 0 && !ids[frame - 1]?.has(id)).length);
  assert.ok(Math.max(...birthCounts) > 0);
  const bornSlots: Uint32Array[] = [];
  for await (const packet of readFrames(makeMemorySource(stream))) bornSlots.push(packet.bornSlots);
  assert.deepEqual(bornSlots.map((slots) => new Set(slots).size), birthCounts);
  for (const slots of bornSlots) assert.deepEqual(slots, slots.slice().sort());
});

test("errors have a kind, and a reject id if the stream is invalid", async () => {
  const stream = readVector("streams/journey");
  await using failingServer = await StreamServer.start(stream, { status: 404 });
  await assert.rejects(readSource({ url: failingServer.url }), expectFault("network", null));
  const truncatedStream = stream.subarray(0, stream.length - 100);
  await using server = await StreamServer.start(truncatedStream);
  await assert.rejects(readSource({ url: server.url }), expectFault("rejected", "truncated"));
  const damagedStream = Uint8Array.from(stream);
  damagedStream[stream.length >> 1] = (damagedStream[stream.length >> 1] ?? 0) ^ 1;
  const frames: FramePacket[] = [];
  const readAll = async (): Promise<void> => {
    for await (const packet of readFrames(makeMemorySource(damagedStream))) frames.push(packet);
  };
  await assert.rejects(readAll(), expectFault("rejected", "payload-crc"));
  assert.ok(frames.length > 0);
});

async function readInfo(name: string): Promise<StreamInfo> {
  await using server = await StreamServer.start(readVector(`streams/${name}`));
  const reportedInfos: StreamInfo[] = [];
  for await (const packet of readFrames({ url: server.url }, { onInfo: (info) => reportedInfos.push(info) })) {
    assert.equal(reportedInfos.length, 1, `onInfo must be called before frame ${packet.frame}`);
  }
  const [info] = reportedInfos;
  assert.ok(info !== undefined);
  assert.equal(info.byteLength, readVector(`streams/${name}`).length);
  return info;
}

test("the description of the stream precedes the first frame", async () => {
  const indexedInfo = await readInfo("journey");
  assert.equal(indexedInfo.frameCount, 9);
  assert.deepEqual(indexedInfo.canonicalFrames, [0, 3, 6]);
  const { cameras, metadata, frameCount } = await readInfo("cameras-and-metadata");
  assert.equal(frameCount, null, "the stream has no INDX");
  assert.equal(cameras.length, 2);
  for (const { name, width, fx, rotation } of cameras) {
    assert.ok(name.length > 0 && width > 0 && fx > 0 && rotation.length === 9);
  }
  assert.deepEqual(metadata, {}); // META follows the first frame in this stream
});

test("the number of listeners does not grow with the number of frames", async (context) => {
  let listenerCount = 0;
  for (const [name, change] of [["addEventListener", 1], ["removeEventListener", -1]] as const) {
    const method = AbortSignal.prototype[name];
    context.mock.method(AbortSignal.prototype, name, function (this: AbortSignal, ...parameters: Parameters<typeof method>) {
      listenerCount += change;
      return method.apply(this, parameters);
    });
  }
  const counts: number[] = [];
  for await (const _ of readFrames(makeMemorySource(readVector("streams/journey")))) {
    await new Promise((resolve) => setTimeout(resolve, 10)); // the decoder waits until another frame is requested
    counts.push(listenerCount);
  }
  assert.equal(counts.length, 9);
  assert.equal(counts.at(-1), counts[1]);
});

test("a signal ends the wait for the next frame of a live stream", async () => {
  const stream = readVector("streams/journey");
  await using server = await StreamServer.start(stream.subarray(0, stream.length - 100));
  const controller = new AbortController();
  const frames: number[] = [];
  const readAll = async (): Promise<void> => {
    for await (const { frame } of readFrames({ url: server.url, isLive: true }, { signal: controller.signal })) {
      frames.push(frame);
      setTimeout(() => controller.abort(new Error("enough")), 200);
    }
  };
  await assert.rejects(readAll(), /enough/);
  assert.ok(frames.length > 0);
  const { signal } = controller; // is already aborted
  await assert.rejects(readFrames({ url: server.url }, { signal }).next(), /enough/);
});

/** Make a chunk (SPEC 5.2). */
function makeChunk(type: string, sequence: number, payload: Uint8Array): Buffer {
  const header = Buffer.from("9e5143f300000000000000000000000000000000", "hex");
  header.write(type, 4, "latin1");
  header.writeUInt32LE(sequence, 8);
  header.writeUInt32LE(payload.length, 12);
  header.writeUInt32LE(crc32(header.subarray(0, 16)), 16);
  const crc = Buffer.alloc(4);
  crc.writeUInt32LE(crc32(payload));
  return Buffer.concat([header, payload, crc]);
}

/** CRC-32/ISO-HDLC (SPEC 4.5). */
function crc32(bytes: Uint8Array): number {
  let crc = -1;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; bit++) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return ~crc >>> 0;
}

/** Make a stream that repeats the first canonical frame of a vector; after its first frame, it has `paddingBytes`. */
function repeatCanonicalFrame(vector: Uint8Array, count: number, paddingBytes: number): Buffer {
  const view = Buffer.from(vector);
  const headEnd = 8 + 24 + view.readUInt32LE(8 + 12);
  let offset = headEnd;
  while (view.toString("latin1", offset + 4, offset + 8) !== "CANO") offset += 24 + view.readUInt32LE(offset + 12);
  const canonical = view.subarray(offset + 20, offset + 20 + view.readUInt32LE(offset + 12));
  const parts: Buffer[] = [view.subarray(0, headEnd)];
  const index = Buffer.alloc(4 + 16 * count);
  index.writeUInt32LE(count);
  let [size, sequence] = [headEnd, 1];
  const add = (type: string, payload: Uint8Array): void => {
    parts.push(makeChunk(type, sequence++, payload));
    size += 24 + payload.length;
  };
  for (let frame = 0; frame < count; frame++) {
    index.writeUInt32LE(size, 4 + 16 * frame);
    index.writeUInt32LE(sequence, 12 + 16 * frame);
    index.writeUInt32LE(frame, 16 + 16 * frame);
    const payload = Buffer.from(canonical);
    payload.writeUInt32LE(frame);
    add("CANO", payload);
    if (frame === 0) add("junk", new Uint8Array(paddingBytes));
  }
  const tail = Buffer.alloc(16);
  tail.writeUInt32LE(count, 0);
  tail.writeUInt32LE(count, 4);
  tail.writeUInt32LE(size, 8);
  add("INDX", index);
  add("TAIL", tail);
  return Buffer.concat(parts);
}

test("the search for a long index does not interrupt the download of the frames", async () => {
  const stream = repeatCanonicalFrame(readVector("streams/journey"), 400, 1 << 19);
  await using server = await StreamServer.start(stream, { bitsPerSecond: 2e7 });
  const replies: DecodeReply[] = [];
  await new Promise<void>((resolve) => {
    const service = new DecodeService((reply) => {
      replies.push(reply);
      if (reply.kind === "end" || reply.kind === "error") resolve();
    });
    service.handle({ kind: "open", source: { url: server.url }, run: 0 });
    service.handle({ kind: "more", frames: 1000, run: 0 });
  });
  assert.equal(replies.at(-1)?.kind, "end", JSON.stringify(replies.at(-1)));
  assert.ok(replies.some((reply) => reply.kind === "info" && reply.info.canonicalFrames.length === 400));
});
