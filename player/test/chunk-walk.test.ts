/** The walk over chunk headers finds the same frames as the decoder. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { ChunkWalk } from "../src/decode/chunk-walk.js";
import { readFrames } from "../src/decode/index.js";
import { makeStreamBytes, type StreamBytes } from "../src/decode/stream-bytes.js";
import { readVector } from "./server.js";

const inMemory = (stream: Uint8Array): StreamBytes => makeStreamBytes({ bytes: Uint8Array.from(stream).buffer });

/** The start of a stream of this size, whose rest has not arrived. */
function arrived(bytes: Uint8Array, size: number | null): StreamBytes {
  const find = (place: number): Uint8Array | null => (place < bytes.length ? bytes.subarray(place) : null);
  return { ...inMemory(bytes), size, find };
}

/** Where the chunks of a stream end, and their types. */
function listChunks(stream: Uint8Array): { end: number; kind: string }[] {
  const [chunks, view]: [{ end: number; kind: string }[], DataView] = [[], new DataView(Uint8Array.from(stream).buffer)];
  for (let place = 8; place < stream.length; ) {
    const kind = new TextDecoder().decode(stream.subarray(place + 4, place + 8));
    place += 24 + view.getUint32(place + 12, true);
    chunks.push({ end: place, kind });
  }
  return chunks;
}

for (const name of ["journey", "snapshots-journey", "births-and-deaths", "updates-journey"]) {
  test(`${name}: the last frame is that of the decoder`, async () => {
    const stream = readVector(`streams/${name}`);
    const walk = new ChunkWalk(inMemory(stream));
    assert.ok(walk.advance() && walk.isEnded);
    let last: number | null = null;
    for await (const { frame } of readFrames({ bytes: Uint8Array.from(stream).buffer })) last = frame;
    assert.equal(walk.lastFrame, last);
  });
}

test("in a growing stream, a frame counts once its last byte has arrived", () => {
  const stream = readVector("streams/journey");
  let frames = 0;
  for (const { end, kind } of listChunks(stream)) {
    const before = new ChunkWalk(inMemory(stream.subarray(0, end - 1)));
    assert.ok(before.advance() && !before.isEnded);
    assert.equal(before.place, end - 1, "available bytes are not requested again");
    assert.equal(before.lastFrame, frames === 0 ? null : frames - 1);
    if (["CANO", "SNAP", "FRAM"].includes(kind)) frames += 1;
    const after = new ChunkWalk(inMemory(stream.subarray(0, end)));
    assert.ok(after.advance());
    assert.equal(after.lastFrame, frames === 0 ? null : frames - 1);
    assert.equal(after.isEnded, kind === "TAIL");
  }
});

test("missing bytes are named, and more frames are expected", () => {
  const stream = readVector("streams/journey");
  const half = stream.subarray(0, stream.length >> 1);
  for (const size of [stream.length, null]) {
    const walk = new ChunkWalk(arrived(half, size));
    assert.equal(walk.advance(), false);
    assert.ok(walk.place >= half.length && walk.place < stream.length);
  }
});

test("a file that is not a stream has no frames", () => {
  const walk = new ChunkWalk(inMemory(new TextEncoder().encode("<!doctype html><p>There is no stream here.")));
  assert.ok(walk.advance() && walk.isEnded);
  assert.equal(walk.lastFrame, null);
});
