/** Streams that are designed to make searches slow: wasted effort is bounded (SPEC 11.4, 13-2). */

import assert from "node:assert/strict";
import { test } from "node:test";
import { setLowestLevel, makeChunk, makeChunkHeader, findChunkOffsets } from "./edits.js";
import { listRecoveredParts } from "./recovered.js";
import { readStream } from "./spec.js";

const STREAM_A = setLowestLevel(readStream("A"));
const FIRST_FRAME_OFFSET = findChunkOffsets(STREAM_A)[1];

test("headers with long payloads are not all checked", { timeout: 60_000 }, () => {
  const header = makeChunkHeader("CANO", 1, 1 << 20);
  const count = 100_000;
  const bytes = Buffer.concat([
    STREAM_A.subarray(0, FIRST_FRAME_OFFSET),
    ...Array.from({ length: count }, () => header),
  ]);

  assert.deepEqual(listRecoveredParts(bytes), [
    [FIRST_FRAME_OFFSET, 20 * count, "payload-crc", null],
    [FIRST_FRAME_OFFSET + 20 * count, 0, "truncated", null],
  ]);
});

test("payloads after successive gaps are not all checked", () => {
  const payloadLength = 1 << 22;
  const pieces = Array.from({ length: 2000 }, (_, i) => {
    const payload = Buffer.from(STREAM_A.subarray(FIRST_FRAME_OFFSET + 20, FIRST_FRAME_OFFSET + 149));
    payload.writeUInt32LE(2 * i);
    return Buffer.concat([makeChunk("CANO", 2 * i + 1, payload), makeChunkHeader("FRAM", 2 * i + 2, payloadLength)]);
  });
  const recoveredParts = listRecoveredParts(
    Buffer.concat([STREAM_A.subarray(0, FIRST_FRAME_OFFSET), ...pieces, Buffer.alloc(payloadLength + 4)]),
  );

  assert.deepEqual(recoveredParts.slice(0, 3), [0, [FIRST_FRAME_OFFSET + 153, 20, "payload-crc", 1], 2]);
  assert.ok(recoveredParts.length < 50, `${recoveredParts.length} parts`);
});
