/** Recovery of damaged streams gives frames and gaps (SPEC 11.4, 11.5). */

import assert from "node:assert/strict";
import { test } from "node:test";
import { changeByte, changePayload, changeType, makeChunk, findChunkOffsets } from "./edits.js";
import { listRecoveredParts } from "./recovered.js";
import type { RecoveredItem } from "./recovered.js";
import { readStream } from "./spec.js";

/** Stream B: cameras, metadata, frames 0 to 3, and INDX. */
const STREAM_B = readStream("B");
const [, CAMERAS_OFFSET, METADATA_OFFSET, B_FIRST_OFFSET, , , , INDX_OFFSET, B_TAIL_OFFSET] =
  findChunkOffsets(STREAM_B);

/** Stream C: frames 1000 to 1004, then the second canonical frame, 1005, and frame 1006. */
const STREAM_C = readStream("C");
const [HEAD_OFFSET, FIRST_OFFSET, , SECOND_OFFSET, THIRD_OFFSET, , CANONICAL_OFFSET, LAST_OFFSET, TAIL_OFFSET] =
  findChunkOffsets(STREAM_C);
const STREAM_C_LENGTH = STREAM_C.length;

/** Return stream C with the bytes from `begin` to `end` replaced by `pieces`. */
function replaceBytes(begin: number, end: number, ...pieces: readonly Uint8Array[]): Uint8Array {
  return Buffer.concat([STREAM_C.subarray(0, begin), ...pieces, STREAM_C.subarray(end)]);
}

test("a stream without damage has no gaps", () => {
  assert.deepEqual(listRecoveredParts(STREAM_B), [0, 1, 2, 3]);
  assert.deepEqual(listRecoveredParts(STREAM_C), [1000, 1001, 1002, 1003, 1004, 1005, 1006]);
});

test("decoding resumes at the next canonical frame", () => {
  const gap: RecoveredItem = [SECOND_OFFSET, CANONICAL_OFFSET - SECOND_OFFSET, "payload-crc", 3];

  assert.deepEqual(listRecoveredParts(changeByte(STREAM_C, SECOND_OFFSET + 20)), [1000, 1001, gap, 1005, 1006]);
});

test("the next sequence number reveals a lost chunk", () => {
  const bytes = replaceBytes(SECOND_OFFSET, THIRD_OFFSET);
  const gap: RecoveredItem = [SECOND_OFFSET, CANONICAL_OFFSET - THIRD_OFFSET, "sequence", 3];

  assert.deepEqual(listRecoveredParts(bytes), [1000, 1001, gap, 1005, 1006]);
});

test("decoding resumes at a canonical frame with an unexpected sequence number, after a gap of 0 bytes", () => {
  const bytes = replaceBytes(SECOND_OFFSET, CANONICAL_OFFSET);

  assert.deepEqual(listRecoveredParts(bytes), [1000, 1001, [SECOND_OFFSET, 0, "sequence", 3], 1005, 1006]);
});

test("decoding does not resume at a past sequence number, even if the frame is still to come", () => {
  const payload = STREAM_C.slice(CANONICAL_OFFSET + 20, LAST_OFFSET - 4);
  payload[0] += 1;
  const oldChunk = makeChunk("CANO", 1, payload);
  const bytes = changeByte(replaceBytes(CANONICAL_OFFSET, CANONICAL_OFFSET, oldChunk), SECOND_OFFSET);
  const gap: RecoveredItem = [SECOND_OFFSET, CANONICAL_OFFSET + oldChunk.length - SECOND_OFFSET, "bad-sync", 3];

  assert.deepEqual(listRecoveredParts(bytes), [1000, 1001, gap, 1005, 1006]);
});

test("decoding also resumes at a canonical frame after INDX", () => {
  const payload = STREAM_B.slice(B_FIRST_OFFSET + 20, B_FIRST_OFFSET + 173);
  payload[0] = 4;
  const appendedChunks = [makeChunk("CANO", 9, payload), makeChunk("TAIL", 10, new Uint8Array(16))];
  const bytes = Buffer.concat([changeByte(STREAM_B, B_TAIL_OFFSET), ...appendedChunks]);

  assert.deepEqual(listRecoveredParts(bytes), [0, 1, 2, 3, [B_TAIL_OFFSET, 40, "bad-sync", 0], 4]);
});

test("decoding does not resume at a canonical frame that has been decoded", () => {
  const bytes = replaceBytes(LAST_OFFSET, LAST_OFFSET, STREAM_C.subarray(CANONICAL_OFFSET, LAST_OFFSET));
  const duplicateLength = LAST_OFFSET - CANONICAL_OFFSET;

  assert.deepEqual(listRecoveredParts(bytes).slice(5), [
    1005,
    [LAST_OFFSET, TAIL_OFFSET + duplicateLength - LAST_OFFSET, "sequence", 1],
  ]);
});

test("the number of frames lost before the first decoded frame is unknown, even at TAIL", () => {
  const bytes = changeByte(changeByte(STREAM_C, FIRST_OFFSET + 20), LAST_OFFSET + 20);
  const gaps: RecoveredItem[] = [
    [FIRST_OFFSET, CANONICAL_OFFSET - FIRST_OFFSET, "payload-crc", null],
    [LAST_OFFSET, TAIL_OFFSET - LAST_OFFSET, "payload-crc", null],
  ];

  assert.deepEqual(listRecoveredParts(bytes), [gaps[0], 1005, gaps[1]]);
});

test("TAIL determines how many frames are lost before it, unless it has fewer than were decoded", () => {
  assert.deepEqual(listRecoveredParts(changeByte(STREAM_C, LAST_OFFSET)).slice(6), [
    [LAST_OFFSET, TAIL_OFFSET - LAST_OFFSET, "bad-sync", 1],
  ]);
  assert.deepEqual(listRecoveredParts(changeByte(STREAM_B, INDX_OFFSET)).slice(4), [[INDX_OFFSET, 44, "bad-sync", 0]]);

  const damagedStream = changePayload(changeByte(STREAM_C, LAST_OFFSET), TAIL_OFFSET, 0, 7 ^ 5);
  assert.deepEqual(listRecoveredParts(damagedStream).slice(6), [
    [LAST_OFFSET, TAIL_OFFSET - LAST_OFFSET, "bad-sync", null],
  ]);
});

test("a canonical frame that is rejected after resuming has its own gap", () => {
  const bytes = changePayload(changeByte(STREAM_C, SECOND_OFFSET), CANONICAL_OFFSET, 105, 1);
  const gaps: RecoveredItem[] = [
    [SECOND_OFFSET, CANONICAL_OFFSET - SECOND_OFFSET, "bad-sync", 3],
    [CANONICAL_OFFSET, TAIL_OFFSET - CANONICAL_OFFSET, "state-crc", 2],
  ];

  assert.deepEqual(listRecoveredParts(bytes), [1000, 1001, ...gaps]);
});

test("ancillary chunks are skipped alone, and INDX and TAIL are still checked", () => {
  const bytes = changePayload(changeByte(STREAM_B, CAMERAS_OFFSET + 20), METADATA_OFFSET, 0, 2);
  const gaps: RecoveredItem[] = [
    [CAMERAS_OFFSET, METADATA_OFFSET - CAMERAS_OFFSET, "payload-crc", 0],
    [METADATA_OFFSET, B_FIRST_OFFSET - METADATA_OFFSET, "field", 0],
  ];
  const indexGap: RecoveredItem = [INDX_OFFSET, 44, "index-mismatch", 0];

  assert.deepEqual(listRecoveredParts(bytes), [...gaps, 0, 1, 2, 3]);
  assert.deepEqual(listRecoveredParts(changePayload(bytes, INDX_OFFSET, 4, 1)), [...gaps, 0, 1, 2, 3, indexGap]);
});

test("damage up to the end of the stream gives two gaps", () => {
  const gaps: RecoveredItem[] = [
    [TAIL_OFFSET, STREAM_C_LENGTH - TAIL_OFFSET, "payload-crc", null],
    [STREAM_C_LENGTH, 0, "truncated", null],
  ];

  assert.deepEqual(listRecoveredParts(changeByte(STREAM_C, TAIL_OFFSET + 20)).slice(7), gaps);
});

test("bytes after TAIL give a gap", () => {
  assert.deepEqual(listRecoveredParts(replaceBytes(STREAM_C_LENGTH, STREAM_C_LENGTH, STREAM_C)).slice(7), [
    [STREAM_C_LENGTH, STREAM_C_LENGTH, "trailing-data", null],
  ]);
});

test("truncation is a gap up to the end, of 0 bytes between chunks", () => {
  assert.deepEqual(listRecoveredParts(STREAM_C.slice(0, THIRD_OFFSET - 1)).slice(2), [
    [SECOND_OFFSET, THIRD_OFFSET - 1 - SECOND_OFFSET, "truncated", null],
  ]);
  assert.deepEqual(listRecoveredParts(STREAM_C.slice(0, SECOND_OFFSET)).slice(2), [
    [SECOND_OFFSET, 0, "truncated", null],
  ]);
});

test("bytes at the end that are shorter than a header are compared with the sync word", () => {
  const cutStream = STREAM_C.slice(0, TAIL_OFFSET);
  const truncated: RecoveredItem = [TAIL_OFFSET + 3, 0, "truncated", null];
  const junk = Uint8Array.of(1, 2, 3);

  assert.deepEqual(listRecoveredParts(STREAM_C.slice(0, TAIL_OFFSET + 3)).slice(7), [
    [TAIL_OFFSET, 3, "truncated", null],
  ]);
  assert.deepEqual(listRecoveredParts(Buffer.concat([cutStream, junk])).slice(7), [
    [TAIL_OFFSET, 3, "bad-sync", null],
    truncated,
  ]);
  assert.deepEqual(listRecoveredParts(STREAM_C.slice(0, HEAD_OFFSET + 3)), [[-1, 0, "truncated", null]]);
  assert.deepEqual(listRecoveredParts(Buffer.concat([STREAM_C.subarray(0, HEAD_OFFSET), junk])), [
    [-1, 0, "bad-sync", null],
  ]);
});

test("a damaged HEAD and unknown critical chunks are rejected", () => {
  assert.deepEqual(listRecoveredParts(changeByte(STREAM_C, HEAD_OFFSET + 20)), [[-1, 0, "payload-crc", null]]);
  assert.deepEqual(listRecoveredParts(changeType(STREAM_C, SECOND_OFFSET, "SNAP")), [
    1000,
    1001,
    [-1, 0, "unknown-critical", null],
  ]);
});
