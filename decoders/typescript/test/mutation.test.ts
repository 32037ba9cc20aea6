/** Streams that are cut or changed: each gives states or a reject id, and nothing else is thrown. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { crc32 } from "../src/crc.js";
import { decodeStream } from "../src/decode.js";
import { philox } from "../src/philox.js";
import { Rejection } from "../src/reject.js";
import type { RejectId } from "../src/reject.js";
import { MemorySource } from "../src/source.js";
import { streamBytes, table } from "./spec.js";

const MAGIC_BYTES = 8;
const HEADER_BYTES = 20;
const LEVEL_PLACE = 10;

/** The frames that are given, and the reject id; null of a stream that is decoded to its end. */
function outcome(bytes: Uint8Array): [number, RejectId | null] {
  let frames = 0;
  try {
    for (const { state } of decodeStream(new MemorySource(bytes))) frames += state.scene.ids.length > 0 ? 1 : 0;
    return [frames, null];
  } catch (error) {
    if (error instanceof Rejection) return [frames, error.rejectId];
    throw error;
  }
}

/** Where the chunks begin. */
function chunkOffsets(bytes: Uint8Array): number[] {
  const offsets = [];
  const view = new DataView(bytes.buffer);
  for (let at = MAGIC_BYTES; at < bytes.length; at += HEADER_BYTES + view.getUint32(at + 12, true) + 4)
    offsets.push(at);
  return offsets;
}

/** The stream with the byte at `place` of the payload of the chunk at `offset` changed, and its CRC made anew. */
function changePayload(bytes: Uint8Array, offset: number, place: number, mask: number): Uint8Array {
  const changed = bytes.slice();
  const view = new DataView(changed.buffer);
  const start = offset + HEADER_BYTES;
  const end = start + view.getUint32(offset + 12, true);
  changed[start + place] ^= mask;
  view.setUint32(end, crc32(changed.subarray(start, end)), true);
  return changed;
}

/** The stream at level 10, whose limits keep the tests short. */
function atLowestLevel(bytes: Uint8Array): Uint8Array {
  return changePayload(bytes, MAGIC_BYTES, LEVEL_PLACE, bytes[MAGIC_BYTES + HEADER_BYTES + LEVEL_PLACE] ^ 10);
}

for (const name of ["A", "B", "C"]) {
  const bytes = atLowestLevel(streamBytes(name));
  const whole = table(`digests ${name}`).length;

  test(`a stream ${name} that is cut gives the frames that are whole, and is refused`, () => {
    const before = new Set<number>();
    for (let length = 0; length < bytes.length; length++) {
      const [frames, rejectId] = outcome(bytes.slice(0, length));

      assert.equal(rejectId, "truncated");
      before.add(frames);
    }
    assert.deepEqual(
      [...before],
      Array.from({ length: whole + 1 }, (_, frames) => frames),
    );
  });

  test(`a stream ${name} with a byte changed is refused`, () => {
    for (let place = 0; place < bytes.length; place++) {
      const changed = bytes.slice();
      changed[place] ^= 1 << (place % 8);

      assert.notEqual(outcome(changed)[1], null, `byte ${place}`);
    }
  });

  test(`a stream ${name} with a payload changed behind a good CRC gives states or a reject id`, () => {
    const view = new DataView(bytes.buffer);
    const ids = new Set<RejectId | null>();
    for (const offset of chunkOffsets(bytes)) {
      for (let place = 0; place < view.getUint32(offset + 12, true); place++) {
        const mask = philox([place, offset, 0, 0], [0, 0])[0] & 0xff || 1;
        ids.add(outcome(changePayload(bytes, offset, place, mask))[1]);
      }
    }
    assert.ok(ids.size > 8, [...ids].join(" "));
  });
}

test("bytes that do not begin the magic are refused", () => {
  assert.deepEqual(outcome(Uint8Array.of(0x89, 0x51, 0x52, 0x44)), [0, "bad-magic"]);
});

test("bytes behind TAIL are refused", () => {
  assert.deepEqual(outcome(Uint8Array.of(...streamBytes("A"), 0)), [1, "trailing-data"]);
});
