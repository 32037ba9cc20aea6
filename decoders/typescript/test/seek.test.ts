/** Seeking in faulty streams without INDX: the headers before the requested frame are checked (SPEC 11.2). */

import assert from "node:assert/strict";
import { test } from "node:test";
import { Rejection } from "../src/reject.js";
import { seekStream } from "../src/seek.js";
import { changeByte, changeType, findChunkOffsets, makeChunk } from "./edits.js";
import { readStream } from "./spec.js";

/** Stream C: frames 1000 to 1004, then the second canonical frame, 1005, and frame 1006. */
const STREAM = readStream("C");
const [HEAD_OFFSET, FIRST_OFFSET, , SECOND_OFFSET, THIRD_OFFSET, , CANONICAL_OFFSET, LAST_OFFSET] =
  findChunkOffsets(STREAM);

/** The ordinals of the decoded frames, and the reject id at the end. */
function seek(bytes: Uint8Array, start: number): (number | string)[] {
  const results: (number | string)[] = [];
  try {
    for (const { state } of seekStream(bytes, start)) results.push(state.ordinal);
  } catch (error) {
    if (!(error instanceof Rejection)) throw error;
    results.push(error.rejectId);
  }
  return results;
}

test("a faulty header before the requested frame is reported, and no payload is decoded", () => {
  const bytes = changeByte(changeByte(STREAM, FIRST_OFFSET + 30), THIRD_OFFSET);

  assert.deepEqual(seek(bytes, 1006), ["bad-sync"]);
  assert.deepEqual(seek(bytes, 1000), ["payload-crc"]);
});

test("frames before a faulty header are decoded", () => {
  assert.deepEqual(seek(changeByte(STREAM, THIRD_OFFSET), 1002), [1002, "bad-sync"]);
  assert.deepEqual(seek(changeByte(STREAM, CANONICAL_OFFSET), 1004), [1004, "bad-sync"]);
});

test("a frame after the end of the stream is not found, and the end is checked", () => {
  assert.deepEqual(seek(STREAM, 2000), []);
  assert.deepEqual(seek(Buffer.concat([STREAM, Uint8Array.of(0)]), 2000), ["trailing-data"]);
  assert.deepEqual(seek(STREAM.subarray(0, LAST_OFFSET), 2000), ["truncated"]);
});

test("the number of frames before a seek point follows from its ordinal", () => {
  const offsets = [...findChunkOffsets(STREAM), STREAM.length];
  const chunks = offsets.slice(1).map((end, i) => ({
    type: Buffer.from(STREAM.subarray(offsets[i] + 4, offsets[i] + 8)).toString(),
    payload: STREAM.subarray(offsets[i] + 20, end - 4),
  }));
  chunks.splice(5, 1); // frame 1004, which TAIL counts
  const shorter = Buffer.concat([
    STREAM.subarray(0, HEAD_OFFSET),
    ...chunks.map(({ type, payload }, sequence) => makeChunk(type, sequence, payload)),
  ]);

  assert.deepEqual(seek(shorter, 1005), [1005, 1006]);
});

test("a canonical frame without an ordinal, or a frame before the first canonical one, is rejected", () => {
  const head = STREAM.subarray(0, FIRST_OFFSET);
  const second = STREAM.subarray(SECOND_OFFSET, THIRD_OFFSET);
  const short = Buffer.concat([head, makeChunk("CANO", 1, new Uint8Array(3))]);

  assert.deepEqual(seek(short, 5), ["field"]);
  assert.deepEqual(seek(Buffer.concat([head, makeChunk("FRAM", 1, second.subarray(20, -4))]), 5), ["chunk-order"]);
});

test("an unknown critical type is reported before its position", () => {
  assert.deepEqual(seek(changeType(STREAM, HEAD_OFFSET, "HEAP"), 0), ["unknown-critical"]);
});
