/** Streams designed to make searches slow: the effort in vain is bounded (SPEC 11.4, 13-2). */

import assert from "node:assert/strict";
import { test } from "node:test";
import { atLowestLevel, chunk, chunkHeader, chunkOffsets } from "./edits.js";
import { recovered } from "./recovered.js";
import { streamBytes } from "./spec.js";

const A = atLowestLevel(streamBytes("A"));
const FIRST = chunkOffsets(A)[1];

test("headers with long payloads are not all checked", { timeout: 60_000 }, () => {
  const header = chunkHeader("CANO", 1, 1 << 20);
  const count = 100_000;
  const bytes = Buffer.concat([A.subarray(0, FIRST), ...Array.from({ length: count }, () => header)]);

  assert.deepEqual(recovered(bytes), [
    [FIRST, 20 * count, "payload-crc", null],
    [FIRST + 20 * count, 0, "truncated", null],
  ]);
});

test("payloads after successive gaps are not all checked", () => {
  const reach = 1 << 22;
  const pieces = Array.from({ length: 2000 }, (_, i) => {
    const payload = Buffer.from(A.subarray(FIRST + 20, FIRST + 149));
    payload.writeUInt32LE(2 * i);
    return Buffer.concat([chunk("CANO", 2 * i + 1, payload), chunkHeader("FRAM", 2 * i + 2, reach)]);
  });
  const parts = recovered(Buffer.concat([A.subarray(0, FIRST), ...pieces, Buffer.alloc(reach + 4)]));

  assert.deepEqual(parts.slice(0, 3), [0, [FIRST + 153, 20, "payload-crc", 1], 2]);
  assert.ok(parts.length < 50, `${parts.length} parts`);
});
