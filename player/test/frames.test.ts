/** Packets reproduce the states of the decoder, for streams in memory and from a server. */

import assert from "node:assert/strict";
import { createServer } from "node:http";
import type { AddressInfo } from "node:net";
import { test, type TestContext } from "node:test";
import { DecodeService } from "../src/decode/decode-service.js";
import { readFrames, StreamError } from "../src/decode/index.js";
import { QuarcModule } from "../src/decode/quarc.js";
import type { DecodeReply, FramePacket, StreamInfo, StreamSource } from "../src/protocol.js";
import { HttpSource } from "../src/decode/source.js";
import { digestState, FrameRebuilder } from "./frame-rebuilder.js";
import { readVector, StreamServer } from "./server.js";

type Headers = Readonly<Record<string, string>>;

const STREAMS = ["journey", "births-and-deaths", "snapshots-journey", "updates-journey", "sh-degree-0"];

interface DecodedFrame {
  readonly frame: number;
  readonly digest: string;
}

/** Digest the states that the decoder returns. The tests of core/ compare its states with the conformance suite. */
async function decodeDirectly(stream: Uint8Array): Promise<DecodedFrame[]> {
  const decoder = (await QuarcModule.load()).open(0);
  decoder.put(0, stream);
  decoder.setLength(stream.length);
  const frames: DecodedFrame[] = [];
  for (let state = decoder.decodeNext(); state !== "end" && state !== null; state = decoder.decodeNext()) {
    frames.push({ frame: state.frame, digest: digestState(state) });
  }
  decoder.close();
  return frames;
}

async function readSource(source: StreamSource, startFrame = 0): Promise<DecodedFrame[]> {
  const rebuilt = new FrameRebuilder();
  const frames: DecodedFrame[] = [];
  for await (const packet of readFrames(source, { from: startFrame })) {
    frames.push({ frame: packet.frame, digest: rebuilt.apply(packet) });
  }
  return frames;
}

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

test("a server without range requests is read sequentially, even after a seek", async () => {
  const stream = readVector("streams/journey");
  const expectedFrames = await decodeDirectly(stream);
  await using server = await StreamServer.start(stream, { supportsRanges: false });
  assert.deepEqual(await readSource({ url: server.url }), expectedFrames);
  assert.deepEqual(await readSource({ url: server.url }, 4), expectedFrames.slice(4));
});

/** Shorten the pauses and the time limits of requests to a thirtieth. */
function shortenPauses(context: TestContext): void {
  const { setTimeout } = globalThis;
  context.mock.method(globalThis, "setTimeout", (callback: () => void, delay = 0, ...parameters: []) =>
    setTimeout(callback, delay < 100 ? delay : delay / 30, ...parameters),
  );
}

test("after a connection breaks, the missing bytes are requested", async (context) => {
  shortenPauses(context);
  const stream = readVector("streams/journey");
  for (const supportsRanges of [true, false]) {
    const breakAfterBytes = supportsRanges ? 500 : stream.length - 1;
    await using server = await StreamServer.start(stream, { supportsRanges, breakAfterBytes });
    if (supportsRanges) assert.deepEqual(await readSource({ url: server.url }), await decodeDirectly(stream));
    else await assert.rejects(readSource({ url: server.url }), expectFault("network", null));
    assert.ok(server.requests.length > 3);
  }
});

test("a connection that stalls counts as broken", async (context) => {
  shortenPauses(context);
  const stream = readVector("streams/journey");
  const expectedFrames = await decodeDirectly(stream);
  for (const isLive of [false, true]) {
    await using server = await StreamServer.start(stream, { stallAfterBytes: stream.length / 2 });
    assert.deepEqual(await readSource({ url: server.url, isLive }), expectedFrames);
    assert.equal(server.requests.filter((range) => range !== "bytes=0-").length, 1);
  }
  await using server = await StreamServer.start(stream, { stallAfterBytes: 0 }); // not even a header
  await assert.rejects(readSource({ url: server.url }), /no byte arrived for 15 s/);
  assert.equal(server.requests.length, 5);
});

test("a response for a live stream may wait for bytes that have not been written", async (context) => {
  shortenPauses(context);
  const { setTimeout } = globalThis;
  const stream = readVector("streams/journey");
  let requests = 0;
  const server = createServer((_, response) => {
    requests += 1;
    setTimeout(() => response.write(stream.subarray(0, 900)), 20_000);
    setTimeout(() => response.end(stream.subarray(900)), 40_000);
  });
  await new Promise<void>((resolve) => server.listen(0, "127.0.0.1", resolve));
  try {
    const url = `http://127.0.0.1:${(server.address() as AddressInfo).port}/`;
    assert.deepEqual(await readSource({ url, isLive: true }), await decodeDirectly(stream));
    assert.equal(requests, 1);
  } finally {
    server.close();
  }
});

test("an address that is invalid is reported without a retry", async (context) => {
  const fetched = context.mock.method(globalThis, "fetch");
  await assert.rejects(readSource({ url: "stream.quarc" }), /the address is invalid/);
  assert.equal(fetched.mock.callCount(), 0);
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

function expectFault(kind: string, rejectId: string | null): (error: unknown) => boolean {
  return (error) => {
    assert.ok(error instanceof StreamError, String(error));
    assert.deepEqual([error.fault.kind, error.fault.rejectId], [kind, rejectId], error.message);
    return true;
  };
}

/** Read a file whose connection breaks, and change it on the server after the first piece; return the bytes read. */
async function readChanging(headers: Headers, change: (server: StreamServer) => void, isLive = false): Promise<number> {
  await using server = await StreamServer.start(readVector("streams/journey"), { breakAfterBytes: 700, headers });
  const abortController = new AbortController();
  let end = 0;
  for await (const { offset, bytes } of new HttpSource({ url: server.url, isLive }).read(0, abortController.signal)) {
    if (end === 0) change(server);
    end = offset + bytes.length;
    if (end === readVector("streams/journey").length) break; // a live stream has no end
  }
  return end;
}

test("a file that is replaced while it is read is a network error", async (context) => {
  shortenPauses(context);
  const other = Uint8Array.from(readVector("streams/journey")).fill(0, 600);
  const [shorter, longer] = [other.subarray(0, 1500), new Uint8Array(other.length + 1)];
  const expectChange = { name: "NetworkError", message: /the file on the server has changed$/ };
  for (const [name, before, after] of [
    ["ETag", '"1"', '"2"'],
    ["Last-Modified", "Tue, 24 Nov 2026 10:00:00 GMT", "Tue, 24 Nov 2026 10:00:01 GMT"],
  ] as const) {
    const replace = (server: StreamServer): void => {
      server.grow(other);
      server.setOptions({ headers: { [name]: after } });
    };
    await assert.rejects(readChanging({ [name]: before }, replace), expectChange, name);
  }
  for (const replacement of [shorter, longer]) {
    await assert.rejects(readChanging({}, (server) => server.grow(replacement)), expectChange);
  }
  await assert.rejects(readChanging({}, (server) => server.grow(shorter.subarray(0, 800)), true), expectChange);
});

test("weak ETags, missing ETags and those of a live stream do not show that a file was replaced", async (context) => {
  shortenPauses(context);
  const modified = "Tue, 24 Nov 2026 10:00:00 GMT";
  const length = readVector("streams/journey").length;
  const laterHeaders: Headers[] = [{ ETag: 'W/"2"' }, { "Last-Modified": modified }, {}];
  for (const after of laterHeaders) {
    const change = (server: StreamServer): void => server.setOptions({ headers: after });
    assert.equal(await readChanging({ ETag: 'W/"1"', "Last-Modified": modified }, change), length);
  }
  const change = (server: StreamServer): void => server.setOptions({ headers: { ETag: '"2"' } });
  assert.equal(await readChanging({ ETag: '"1"' }, change, true), length);
});

test("a server need not tell the size of a stream", async () => {
  const stream = readVector("streams/journey");
  for (const unknownSizePartBytes of [stream.length, 1000]) {
    await using server = await StreamServer.start(stream, { unknownSizePartBytes });
    assert.deepEqual(await readSource({ url: server.url }), await decodeDirectly(stream));
    assert.deepEqual((await readSource({ url: server.url }, 4)).length, 5);
  }
});

test("a live stream is followed to its end", async () => {
  const stream = readVector("streams/journey");
  const expectedFrames = await decodeDirectly(stream);
  await using server = await StreamServer.start(stream.subarray(0, 900));
  const growthTimers = [1200, 1800, stream.length].map((size, index) =>
    setTimeout(() => server.grow(stream.subarray(0, size)), 300 * (index + 1)),
  );
  assert.deepEqual(await readSource({ url: server.url, isLive: true }), expectedFrames);
  growthTimers.forEach(clearTimeout);
});

test("a live stream that is played at its newest frame survives an outage", async (context) => {
  shortenPauses(context);
  const stream = readVector("streams/journey");
  await using server = await StreamServer.start(stream.subarray(0, 900));
  const waitForRequests = async (count: number): Promise<void> => {
    const end = server.requests.length + count;
    for (let waits = 0; server.requests.length < end; waits++) {
      assert.ok(waits < 3000, "no more requests come");
      await new Promise((resolve) => setTimeout(resolve, 10));
    }
  };
  const frames = readSource({ url: server.url, isLive: true });
  await waitForRequests(2);
  server.setOptions({ status: 503 });
  await waitForRequests(8);
  server.setOptions({ status: null });
  server.grow(stream);
  assert.deepEqual(await frames, await decodeDirectly(stream));
});

test("failures of requests for a live stream do not add up while other requests succeed", async (context) => {
  shortenPauses(context);
  const stream = readVector("streams/journey");
  await using server = await StreamServer.start(stream.subarray(0, 900));
  const { fetch } = globalThis;
  let requestCount = 0;
  context.mock.method(globalThis, "fetch", (...request: Parameters<typeof fetch>) => {
    if (++requestCount === 13) server.grow(stream);
    return requestCount % 2 === 0 ? Promise.reject(new TypeError("offline")) : fetch(...request);
  });
  assert.deepEqual(await readSource({ url: server.url, isLive: true }), await decodeDirectly(stream));
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
