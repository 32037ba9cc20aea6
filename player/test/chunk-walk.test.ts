/** The walk over chunk headers finds the frames that the decoder finds. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { ChunkWalk } from "../src/decode/chunk-walk.js";
import { readFrames } from "../src/decode/index.js";
import { makeStreamBytes, type StreamBytes } from "../src/decode/stream-bytes.js";
import { readVector } from "./server.js";

const makeMemoryStream = (stream: Uint8Array): StreamBytes => makeStreamBytes({ bytes: Uint8Array.from(stream).buffer });

/** Make a stream of `size` bytes, of which only `bytes` have arrived. */
function makePartialStream(bytes: Uint8Array, size: number | null): StreamBytes {
  const findAvailable = (offset: number): Uint8Array | null => (offset < bytes.length ? bytes.subarray(offset) : null);
  return { ...makeMemoryStream(bytes), size, findAvailable };
}

/** List the type and the end offset of each chunk of a stream. */
function listChunks(stream: Uint8Array): { end: number; chunkType: string }[] {
  const chunks: { end: number; chunkType: string }[] = [];
  const view = new DataView(Uint8Array.from(stream).buffer);
  for (let offset = 8; offset < stream.length; ) {
    const chunkType = new TextDecoder().decode(stream.subarray(offset + 4, offset + 8));
    offset += 24 + view.getUint32(offset + 12, true);
    chunks.push({ end: offset, chunkType });
  }
  return chunks;
}

for (const name of ["journey", "snapshots-journey", "births-and-deaths", "updates-journey"]) {
  test(`${name}: the walk and the decoder find the same last frame`, async () => {
    const stream = readVector(`streams/${name}`);
    const chunkWalk = new ChunkWalk(makeMemoryStream(stream));
    assert.ok(chunkWalk.advance() && chunkWalk.hasEnded);
    let lastFrame: number | null = null;
    for await (const { frame } of readFrames({ bytes: Uint8Array.from(stream).buffer })) lastFrame = frame;
    assert.equal(chunkWalk.lastFrame, lastFrame);
  });
}

test("a frame of a growing stream is counted when its last byte has arrived", () => {
  const stream = readVector("streams/journey");
  let frameCount = 0;
  for (const { end, chunkType } of listChunks(stream)) {
    const walkBefore = new ChunkWalk(makeMemoryStream(stream.subarray(0, end - 1)));
    assert.ok(walkBefore.advance() && !walkBefore.hasEnded);
    assert.equal(walkBefore.nextOffset, end - 1, "available bytes are not requested again");
    assert.equal(walkBefore.lastFrame, frameCount === 0 ? null : frameCount - 1);
    if (["CANO", "SNAP", "FRAM"].includes(chunkType)) frameCount += 1;
    const walkAfter = new ChunkWalk(makeMemoryStream(stream.subarray(0, end)));
    assert.ok(walkAfter.advance());
    assert.equal(walkAfter.lastFrame, frameCount === 0 ? null : frameCount - 1);
    assert.equal(walkAfter.hasEnded, chunkType === "TAIL");
    for (const walk of [walkBefore, walkAfter]) { // if the size is not known, the same frames have arrived
      const arrived = stream.subarray(0, walk === walkAfter ? end : end - 1);
      const walkWithoutSize = new ChunkWalk(makePartialStream(arrived, null));
      assert.equal(walkWithoutSize.advance(), walkWithoutSize.hasEnded);
      assert.deepEqual([walkWithoutSize.lastFrame, walkWithoutSize.hasEnded], [walk.lastFrame, walk.hasEnded]);
    }
  }
});

test("the walk stops at missing bytes and names their offset", () => {
  const stream = readVector("streams/journey");
  const firstHalf = stream.subarray(0, stream.length >> 1);
  for (const size of [stream.length, null]) {
    const chunkWalk = new ChunkWalk(makePartialStream(firstHalf, size));
    assert.equal(chunkWalk.advance(), false);
    assert.ok(chunkWalk.nextOffset >= firstHalf.length && chunkWalk.nextOffset < stream.length);
  }
});

test("a file that is not a stream has no frames", () => {
  const chunkWalk = new ChunkWalk(makeMemoryStream(new TextEncoder().encode("<!doctype html><p>There is no stream here.")));
  assert.ok(chunkWalk.advance() && chunkWalk.hasEnded);
  assert.equal(chunkWalk.lastFrame, null);
});
