/** Decoding a truncated or modified stream gives states or a reject id, and no other error. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { decodeStream } from "../src/decode.js";
import { philox } from "../src/philox.js";
import { Rejection } from "../src/reject.js";
import type { RejectId } from "../src/reject.js";
import { MemorySource } from "../src/source.js";
import { setLowestLevel, changeByte, changePayload, findChunkOffsets } from "./edits.js";
import { listRecoveredParts } from "./recovered.js";
import { readStream, readTable } from "./spec.js";

/** Decode a stream; return the number of frames, and the reject id or null. */
function decodeAll(bytes: Uint8Array): [number, RejectId | null] {
  let frames = 0;
  try {
    for (const { state } of decodeStream(new MemorySource(bytes))) frames += state.scene.ids.length > 0 ? 1 : 0;
    return [frames, null];
  } catch (error) {
    if (error instanceof Rejection) return [frames, error.rejectId];
    throw error;
  }
}

for (const name of ["A", "B", "C"]) {
  const bytes = setLowestLevel(readStream(name));
  const digests = new Map(readTable(`digests ${name}`).map((row) => [Number(row[0]), row[5]]));

  test(`a stream ${name} that is truncated gives its complete frames and is rejected`, () => {
    const frameCounts = new Set<number>();
    for (let length = 0; length < bytes.length; length++) {
      const [frames, rejectId] = decodeAll(bytes.slice(0, length));

      assert.equal(rejectId, "truncated");
      frameCounts.add(frames);
    }
    assert.deepEqual(
      [...frameCounts],
      Array.from({ length: digests.size + 1 }, (_, frames) => frames),
    );
  });

  test(`a stream ${name} with a changed byte is rejected`, () => {
    for (let offset = 0; offset < bytes.length; offset++) {
      const changedBytes = changeByte(bytes, offset, 1 << (offset % 8));

      assert.notEqual(decodeAll(changedBytes)[1], null, `byte ${offset}`);
    }
  });

  test(`a stream ${name} with a changed payload and a correct CRC gives states or a reject id`, () => {
    const view = new DataView(bytes.buffer);
    const ids = new Set<RejectId | null>();
    for (const offset of findChunkOffsets(bytes)) {
      for (let byteIndex = 0; byteIndex < view.getUint32(offset + 12, true); byteIndex++) {
        const mask = philox([byteIndex, offset, 0, 0], [0, 0])[0] & 0xff || 1;
        ids.add(decodeAll(changePayload(bytes, offset, byteIndex, mask))[1]);
      }
    }
    assert.ok(ids.size > 8, [...ids].join(" "));
  });

  test(`recovery of a stream ${name} with any changed byte gives true frames, and gaps in order`, () => {
    for (let offset = 0; offset < bytes.length; offset++) {
      const parts = listRecoveredParts(changeByte(bytes, offset, 1 << (offset % 8)), digests);
      const frames = parts.filter((part) => typeof part === "number");
      const gaps = parts.filter((part) => typeof part !== "number");

      assert.ok(frames.every((frame, i) => i === 0 || frame > frames[i - 1]));
      assert.ok(gaps.every(([offset], i) => i === 0 || offset >= gaps[i - 1][0] + gaps[i - 1][1]));
      assert.ok(gaps.length > 0, `byte ${offset}`);
    }
  });
}

test("bytes that do not start with the magic are rejected", () => {
  assert.deepEqual(decodeAll(Uint8Array.of(0x89, 0x51, 0x52, 0x44)), [0, "bad-magic"]);
});

test("bytes after TAIL are rejected", () => {
  assert.deepEqual(decodeAll(Uint8Array.of(...readStream("A"), 0)), [1, "trailing-data"]);
});
