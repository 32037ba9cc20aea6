/** Packets match the states of the decoder, for all sources of bytes. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { readFrames, StreamError } from "../src/decode/index.js";
import { Quarc } from "../src/decode/quarc.js";
import type { FramePacket, StreamInfo, StreamSource } from "../src/protocol.js";
import { digestState, Rebuilt } from "./rebuild.js";
import { readVector, StreamServer } from "./server.js";

const STREAMS = ["journey", "births-and-deaths", "snapshots-journey", "updates-journey", "sh-degree-0"];

interface Shown {
  readonly frame: number;
  readonly digest: string;
}

/** The states of the decoder itself; core/ checks its digests against the suite. */
async function decode(stream: Uint8Array): Promise<Shown[]> {
  const decoder = (await Quarc.load()).open(0);
  decoder.put(0, stream);
  decoder.limit(stream.length);
  const shown: Shown[] = [];
  for (let state = decoder.pull(); state !== "end" && state !== null; state = decoder.pull()) {
    shown.push({ frame: state.frame, digest: digestState(state) });
  }
  decoder.close();
  return shown;
}

async function show(source: StreamSource, from = 0): Promise<Shown[]> {
  const rebuilt = new Rebuilt();
  const shown: Shown[] = [];
  for await (const packet of readFrames(source, { from })) {
    shown.push({ frame: packet.frame, digest: rebuilt.take(packet) });
  }
  return shown;
}

const inMemory = (stream: Uint8Array): StreamSource => ({ bytes: Uint8Array.from(stream).buffer });

for (const name of STREAMS) {
  test(`${name}: packets reproduce the state of every frame`, async () => {
    const stream = readVector(`streams/${name}`);
    const due = await decode(stream);
    assert.ok(due.length > 0);
    assert.deepEqual(await show(inMemory(stream)), due);
  });

  test(`${name}: a seek gives the same frames as playing`, async () => {
    const stream = readVector(`streams/${name}`);
    const due = await decode(stream);
    await using server = await StreamServer.start(stream);
    for (let from = 1; from < due.length; from++) {
      const wanted = due.filter(({ frame }) => frame >= from);
      assert.deepEqual(await show({ url: server.url }, from), wanted, `from ${from}`);
    }
  });
}

test("a server without range requests is read sequentially, even after a seek", async () => {
  const stream = readVector("streams/journey");
  const due = await decode(stream);
  await using server = await StreamServer.start(stream, { ranges: false });
  assert.deepEqual(await show({ url: server.url }), due);
  assert.deepEqual(await show({ url: server.url }, 4), due.slice(4));
});

test("after a broken connection the rest is requested", async () => {
  const stream = readVector("streams/journey");
  for (const ranges of [true, false]) {
    const diesAfter = ranges ? 700 : stream.length - 1;
    await using server = await StreamServer.start(stream, { ranges, diesAfter });
    if (ranges) assert.deepEqual(await show({ url: server.url }), await decode(stream));
    else await assert.rejects(show({ url: server.url }), isFault("network", null));
    assert.ok(server.requests.length > 3);
  }
});

test("errors have a kind, and a reject id if the stream is invalid", async () => {
  const stream = readVector("streams/journey");
  await using missing = await StreamServer.start(stream, { status: 404 });
  await assert.rejects(show({ url: missing.url }), isFault("network", null));
  const cut = stream.subarray(0, stream.length - 100);
  await using server = await StreamServer.start(cut);
  await assert.rejects(show({ url: server.url }), isFault("rejected", "truncated"));
  const changed = Uint8Array.from(stream);
  changed[stream.length >> 1] = (changed[stream.length >> 1] ?? 0) ^ 1;
  const frames: FramePacket[] = [];
  const play = async (): Promise<void> => {
    for await (const packet of readFrames(inMemory(changed))) frames.push(packet);
  };
  await assert.rejects(play(), isFault("rejected", "payload-crc"));
  assert.ok(frames.length > 0);
});

function isFault(kind: string, rejectId: string | null): (error: unknown) => boolean {
  return (error) => {
    assert.ok(error instanceof StreamError, String(error));
    assert.deepEqual([error.fault.kind, error.fault.rejectId], [kind, rejectId], error.message);
    return true;
  };
}

test("a live stream is followed to its end", async () => {
  const stream = readVector("streams/journey");
  const due = await decode(stream);
  await using server = await StreamServer.start(stream.subarray(0, 900));
  const growing = [1200, 1800, stream.length].map((size, at) =>
    setTimeout(() => server.grow(stream.subarray(0, size)), 300 * (at + 1)),
  );
  assert.deepEqual(await show({ url: server.url, isLive: true }), due);
  growing.forEach(clearTimeout);
});

async function learn(name: string): Promise<StreamInfo> {
  await using server = await StreamServer.start(readVector(`streams/${name}`));
  const told: StreamInfo[] = [];
  for await (const packet of readFrames({ url: server.url }, { onInfo: (info) => told.push(info) })) {
    assert.equal(told.length, 1, `before frame ${packet.frame}`);
  }
  const [info] = told;
  assert.ok(info !== undefined);
  assert.equal(info.byteLength, readVector(`streams/${name}`).length);
  return info;
}

test("the description of the stream precedes the first frame", async () => {
  const indexed = await learn("journey");
  assert.equal(indexed.frameCount, 9);
  assert.deepEqual(indexed.canonicalFrames, [0, 3, 6]);
  const { cameras, metadata, frameCount } = await learn("cameras-and-metadata");
  assert.equal(frameCount, null, "it has no INDX");
  assert.equal(cameras.length, 2);
  for (const { name, width, fx, rotation } of cameras) {
    assert.ok(name.length > 0 && width > 0 && fx > 0 && rotation.length === 9);
  }
  assert.deepEqual(metadata, {}); // which come later in this stream
});
