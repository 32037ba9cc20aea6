/** Damaged streams: the recovered frames, and the gaps (SPEC 11.4, 11.5). */

import assert from "node:assert/strict";
import { test } from "node:test";
import { changeByte, changePayload, changeType, chunk, chunkOffsets } from "./edits.js";
import { recovered } from "./recovered.js";
import type { Part } from "./recovered.js";
import { streamBytes } from "./spec.js";

/** Frames 0 to 3, preceded by cameras and metadata, and INDX. */
const B = streamBytes("B");
const [, CAMERAS, METADATA, B_FIRST, , , , INDX, B_TAIL] = chunkOffsets(B);

/** Frames 1000 to 1004, then a second canonical frame, 1005, and one more frame. */
const C = streamBytes("C");
const [HEAD, FIRST, , SECOND, THIRD, , CANONICAL, LAST, TAIL] = chunkOffsets(C);
const END = C.length;

/** Stream C with the bytes from `begin` to `end` replaced. */
function splice(begin: number, end: number, ...pieces: readonly Uint8Array[]): Uint8Array {
  return Buffer.concat([C.subarray(0, begin), ...pieces, C.subarray(end)]);
}

test("a stream without damage has no gaps", () => {
  assert.deepEqual(recovered(B), [0, 1, 2, 3]);
  assert.deepEqual(recovered(C), [1000, 1001, 1002, 1003, 1004, 1005, 1006]);
});

test("decoding resumes at the next canonical frame", () => {
  const gap: Part = [SECOND, CANONICAL - SECOND, "payload-crc", 3];

  assert.deepEqual(recovered(changeByte(C, SECOND + 20)), [1000, 1001, gap, 1005, 1006]);
});

test("a lost chunk is noticed by the next sequence number", () => {
  const bytes = splice(SECOND, THIRD);
  const gap: Part = [SECOND, CANONICAL - THIRD, "sequence", 3];

  assert.deepEqual(recovered(bytes), [1000, 1001, gap, 1005, 1006]);
});

test("decoding resumes at a canonical frame with an unexpected sequence number, after a gap of 0 bytes", () => {
  const bytes = splice(SECOND, CANONICAL);

  assert.deepEqual(recovered(bytes), [1000, 1001, [SECOND, 0, "sequence", 3], 1005, 1006]);
});

test("decoding does not resume at a past sequence number, even if the frame is still to come", () => {
  const payload = C.slice(CANONICAL + 20, LAST - 4);
  payload[0] += 1;
  const old = chunk("CANO", 1, payload);
  const bytes = changeByte(splice(CANONICAL, CANONICAL, old), SECOND);
  const gap: Part = [SECOND, CANONICAL + old.length - SECOND, "bad-sync", 3];

  assert.deepEqual(recovered(bytes), [1000, 1001, gap, 1005, 1006]);
});

test("decoding also resumes at a canonical frame after INDX", () => {
  const payload = B.slice(B_FIRST + 20, B_FIRST + 173);
  payload[0] = 4;
  const more = [chunk("CANO", 9, payload), chunk("TAIL", 10, new Uint8Array(16))];
  const bytes = Buffer.concat([changeByte(B, B_TAIL), ...more]);

  assert.deepEqual(recovered(bytes), [0, 1, 2, 3, [B_TAIL, 40, "bad-sync", 0], 4]);
});

test("decoding does not resume at a canonical frame that has been decoded", () => {
  const bytes = splice(LAST, LAST, C.subarray(CANONICAL, LAST));
  const twice = LAST - CANONICAL;

  assert.deepEqual(recovered(bytes).slice(5), [1005, [LAST, TAIL + twice - LAST, "sequence", 1]]);
});

test("the number of frames lost before the first decoded one is unknown, there and at TAIL", () => {
  const bytes = changeByte(changeByte(C, FIRST + 20), LAST + 20);
  const gaps: Part[] = [
    [FIRST, CANONICAL - FIRST, "payload-crc", null],
    [LAST, TAIL - LAST, "payload-crc", null],
  ];

  assert.deepEqual(recovered(bytes), [gaps[0], 1005, gaps[1]]);
});

test("TAIL determines how many frames are lost before it, unless it has fewer than were decoded", () => {
  assert.deepEqual(recovered(changeByte(C, LAST)).slice(6), [[LAST, TAIL - LAST, "bad-sync", 1]]);
  assert.deepEqual(recovered(changeByte(B, INDX)).slice(4), [[INDX, 44, "bad-sync", 0]]);

  const fewer = changePayload(changeByte(C, LAST), TAIL, 0, 7 ^ 5);
  assert.deepEqual(recovered(fewer).slice(6), [[LAST, TAIL - LAST, "bad-sync", null]]);
});

test("a canonical frame that is rejected after resuming has its own gap", () => {
  const bytes = changePayload(changeByte(C, SECOND), CANONICAL, 105, 1);
  const gaps: Part[] = [
    [SECOND, CANONICAL - SECOND, "bad-sync", 3],
    [CANONICAL, TAIL - CANONICAL, "state-crc", 2],
  ];

  assert.deepEqual(recovered(bytes), [1000, 1001, ...gaps]);
});

test("ancillary chunks are skipped alone, and INDX and TAIL are still checked", () => {
  const bytes = changePayload(changeByte(B, CAMERAS + 20), METADATA, 0, 2);
  const gaps: Part[] = [
    [CAMERAS, METADATA - CAMERAS, "payload-crc", 0],
    [METADATA, B_FIRST - METADATA, "field", 0],
  ];
  const index: Part = [INDX, 44, "index-mismatch", 0];

  assert.deepEqual(recovered(bytes), [...gaps, 0, 1, 2, 3]);
  assert.deepEqual(recovered(changePayload(bytes, INDX, 4, 1)), [...gaps, 0, 1, 2, 3, index]);
});

test("damage up to the end is two gaps", () => {
  const gaps: Part[] = [
    [TAIL, END - TAIL, "payload-crc", null],
    [END, 0, "truncated", null],
  ];

  assert.deepEqual(recovered(changeByte(C, TAIL + 20)).slice(7), gaps);
});

test("bytes after TAIL are a gap", () => {
  assert.deepEqual(recovered(splice(END, END, C)).slice(7), [[END, END, "trailing-data", null]]);
});

test("truncation is a gap up to the end, of 0 bytes between chunks", () => {
  assert.deepEqual(recovered(C.slice(0, THIRD - 1)).slice(2), [[SECOND, THIRD - 1 - SECOND, "truncated", null]]);
  assert.deepEqual(recovered(C.slice(0, SECOND)).slice(2), [[SECOND, 0, "truncated", null]]);
});

test("a damaged HEAD and unknown critical chunks are rejected", () => {
  assert.deepEqual(recovered(changeByte(C, HEAD + 20)), [[-1, 0, "payload-crc", null]]);
  assert.deepEqual(recovered(changeType(C, SECOND, "SNAP")), [1000, 1001, [-1, 0, "unknown-critical", null]]);
});
