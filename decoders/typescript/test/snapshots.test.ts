/** Snapshots (7.9, 8.9): their planes, their effect on a CANO, and streams that contain them (5.10, 11). */

import assert from "node:assert/strict";
import { test } from "node:test";
import type { CanonicalGaussians } from "../src/canonical.js";
import { tabulate } from "../src/columns.js";
import { FEATURE_SNAPSHOTS } from "../src/constants.js";
import { decodeStream } from "../src/decode.js";
import { stateDigest } from "../src/digest.js";
import type { StreamHeader } from "../src/header.js";
import { Rejection } from "../src/reject.js";
import type { RejectId } from "../src/reject.js";
import { seekStream } from "../src/seek.js";
import { applyDifferences, decodeSurvivors, sortGaussians, SurvivorModels } from "../src/snapshots.js";
import type { Survivors } from "../src/snapshots.js";
import { MemorySource } from "../src/source.js";
import { changeByte, chunk, chunkOffsets } from "./edits.js";
import { recovered } from "./recovered.js";
import { classPlanes, scripted } from "./script.js";
import { streamBytes, table } from "./spec.js";

const HEADER = { positionStep: 4, rotationBits: 8 } as StreamHeader;

/** `count` Gaussians with 16 codes; Gaussian i is at (10 i, 0, 0) and has the rotation i mod 4, (1, 2, i). */
function gaussiansOf(count: number): CanonicalGaussians {
  const rows = (length: number, value: (row: number, i: number) => number) =>
    Array.from({ length }, (_, row) => tabulate(count, (i) => value(row, i)));
  return {
    positions: rows(3, (row, i) => (row === 0 ? 10 * i : 0)),
    coded: { indices: Uint8Array.from({ length: count }, (_, i) => i % 4), parts: rows(3, (row, i) => [1, 2, i][row]) },
    rotations: rows(4, () => 0),
    codes: rows(16, (row, i) => 100 * row + i),
  };
}

/** Survivors whose differences are 0 except those in `given` (row, index, difference). */
function survivorsOf(indices: number[], ...given: [number, number, number][]): Survivors {
  const differences = Array.from({ length: 14 }, () => new Int32Array(indices.length));
  for (const [row, place, difference] of given) differences[row][place] = difference;
  return { indices: Uint32Array.from(indices), differences };
}

test("planes are read in the order and contexts of 8.9", () => {
  const models = new SurvivorModels();
  const { class: classes, sign } = models.differences;
  // Of Gaussians 0 to 3, all but 1 survive: 0 and 3 with position, 2 with rotation, 3 with opacity.
  const section = scripted([
    [models.lives, [0, 0, 0, 0], [1, 0, 1, 1]],
    [models.fields[0], [0, 0, 0], [1, 0, 1]],
    [models.fields[1], [1, 0, 1], [0, 1, 0]],
    [models.fields[2], [1, 2, 1], [0, 0, 0]],
    [models.fields[3], [1, 2, 1], [0, 0, 1]],
    [models.fields[4], [1, 2, 9], [0, 0, 0]],
    // x: 1, and 1 less; y: 0 and 1; z: 0 and -1, after sums of 1 and 2.
    ...classPlanes(classes, [0, 0], [1, 1]),
    [sign, [1, 1], [0, 1]],
    ...classPlanes(classes, [9, 9], [0, 1]),
    [sign, [145], [0]],
    ...classPlanes(classes, [17, 18], [0, 1]),
    [sign, [289], [1]],
    // j: 2; a: -1, b: 1, c: 0, after sums of 0, 1 and 2, which do not include j.
    [models.index.class, [1], [1]],
    [models.index.class, [3], [0]],
    ...classPlanes(classes, [32], [1]),
    [sign, [513], [1]],
    ...classPlanes(classes, [41], [1]),
    [sign, [657], [0]],
    ...classPlanes(classes, [50], [0]),
    // Opacity: 1.
    ...classPlanes(classes, [80], [1]),
    [sign, [1281], [0]],
  ]);
  const survivors = decodeSurvivors(section, models, 4);
  section.finish();

  const position: [number, number, number][] = [[0, 0, 1], [0, 2, 0], [1, 2, 1], [2, 2, -1]];
  assert.deepEqual(survivors, survivorsOf([0, 2, 3], ...position, [3, 1, 2], [4, 1, -1], [5, 1, 1], [10, 2, 1]));
});

test("differences are added, except to the components of a rotation whose index changes", () => {
  const before = gaussiansOf(4);
  const changed = applyDifferences(
    survivorsOf([1, 3], [0, 0, -3], [2, 1, 5], [3, 1, 3], [4, 0, 7], [4, 1, 9], [10, 0, -1], [13, 1, 6]),
    before,
    HEADER,
  );

  assert.deepEqual(changed.positions.map((row) => Array.from(row)), [[7, 30], [0, 0], [0, 5]]);
  assert.deepEqual(Array.from(changed.coded.indices), [1, 2]);
  assert.deepEqual(changed.coded.parts.map((row) => Array.from(row)), [[8, 9], [2, 0], [1, 0]]);
  assert.deepEqual([changed.codes[3][0], changed.codes[6][1], changed.codes[7][1]], [300, 609, 703]);
  assert.deepEqual(before, gaussiansOf(4));
});

const REFUSED: readonly (readonly [string, RejectId, Survivors])[] = [
  ["a position is off the lattice", "position-range", survivorsOf([0], [1, 0, 2097152])],
  ["a code is too large", "code-range", survivorsOf([1], [11, 0, 32767])],
  ["a rotation component is too large", "rotation-range", survivorsOf([0], [4, 0, 256])],
];

for (const [what, rejectId, survivors] of REFUSED) {
  test(`survivors are rejected if ${what}: ${rejectId}`, () => {
    assert.throws(() => applyDifferences(survivors, gaussiansOf(2), HEADER), { rejectId });
  });
}

test("Gaussians are sorted stably by Morton keys relative to their minimum, and must not be too far apart", () => {
  const at = (...x: number[]) => ({ ...gaussiansOf(x.length), positions: [x, x, x].map((row) => Int32Array.from(row)) });
  const sorted = sortGaussians(at(3, -5, 0, -5, 2));

  assert.deepEqual(Array.from(sorted.positions[0]), [-5, -5, 0, 2, 3]);
  assert.deepEqual(Array.from(sorted.codes[0]), [1, 3, 2, 4, 0]);
  assert.equal(sortGaussians(at(-1, 2 ** 20 - 2)).positions[0][1], 2 ** 20 - 2);
  assert.throws(() => sortGaussians(at(-1, 2 ** 20 - 1)), { rejectId: "symbol-range" });
});

/** Frames 1000 to 1006 of stream C, with the last canonical frame replaced by a snapshot without survivors. */
const C = withSnapshot(streamBytes("C"), FEATURE_SNAPSHOTS, 1000);
const [, , , SECOND, , , SNAPSHOT, , TAIL] = chunkOffsets(C);
const DIGESTS = new Map(table("digests C").map((row) => [Number(row[0]), row[5]]));
const ORDINALS = [...DIGESTS.keys()];

test("a snapshot has the same state as a CANO of the same Gaussians", () => {
  assert.deepEqual(outcome(() => decodeStream(new MemorySource(C))), [ORDINALS, null]);
});

test("seeking to a snapshot decodes its CANO without returning it", () => {
  for (let start = 998; start < 1009; start++) {
    const expected = ORDINALS.filter((ordinal) => ordinal >= start);
    assert.deepEqual(outcome(() => seekStream(C, start)), [expected, null]);
    const cut = C.subarray(0, TAIL);
    assert.deepEqual(outcome(() => seekStream(cut, start)), [expected, "truncated"]);
  }
  const other = withSnapshot(streamBytes("C"), FEATURE_SNAPSHOTS, 999);
  assert.deepEqual(outcome(() => seekStream(other, 1006)), [[], "index-mismatch"]);
});

test("seeking works with and without INDX", () => {
  const stream = streamBytes("B");
  for (let start = 0; start < 5; start++) {
    const expected = [0, 1, 2, 3].filter((ordinal) => ordinal >= start);
    assert.deepEqual(ordinals(seekStream(stream, start)), expected);
  }
  const offset = chunkOffsets(stream).at(-2) ?? 0;
  assert.throws(() => ordinals(seekStream(changeByte(stream, offset), 1)), { rejectId: "index-mismatch" });
  assert.throws(() => ordinals(seekStream(changeByte(stream, offset + 20), 1)), { rejectId: "payload-crc" });
});

test("decoding resumes only at a snapshot whose CANO has been decoded", () => {
  const gap = [SECOND, SNAPSHOT - SECOND, "payload-crc", 3] as const;
  assert.deepEqual(recovered(changeByte(C, SECOND + 20), DIGESTS), [1000, 1001, gap, 1005, 1006]);

  const other = changeByte(withSnapshot(streamBytes("C"), FEATURE_SNAPSHOTS, 999), SECOND + 20);
  assert.deepEqual(recovered(other), [1000, 1001, [SECOND, TAIL - SECOND, "payload-crc", 5]]);
});

test("a snapshot must refer to the last CANO, and needs its feature in HEAD", () => {
  const first = ORDINALS.slice(0, 5);
  const decode = (features: number, canonical: number) =>
    outcome(() => decodeStream(new MemorySource(withSnapshot(streamBytes("C"), features, canonical))));

  assert.deepEqual(decode(FEATURE_SNAPSHOTS, 1001), [first, "frame-order"]);
  assert.deepEqual(decode(0, 1000), [first, "unknown-critical"]);
});

/**
 * Checks the digests of frames; returns their ordinals and the reject id, or null if the stream is decoded to its end.
 */
function outcome(frames: () => Iterable<{ state: Parameters<typeof ordinalOf>[0] }>): [number[], RejectId | null] {
  const given: number[] = [];
  try {
    for (const { state } of frames()) given.push(ordinalOf(state));
    return [given, null];
  } catch (error) {
    if (error instanceof Rejection) return [given, error.rejectId];
    throw error;
  }
}

function ordinalOf(state: { ordinal: number; phase: number; scene: Parameters<typeof stateDigest>[0] }): number {
  assert.equal(stateDigest(state.scene, state.phase), DIGESTS.get(state.ordinal));
  return state.ordinal;
}

function ordinals(frames: ReturnType<typeof seekStream>): number[] {
  return [...frames].map(({ state }) => state.ordinal);
}

/** A stream of Annex G with these features, whose second CANO is replaced by a snapshot against frame `canonical`. */
function withSnapshot(stream: Uint8Array, features: number, canonical: number): Uint8Array {
  const bytes = Buffer.from(stream);
  const parts: Uint8Array[] = [bytes.subarray(0, 8)];
  let canonicals = 0;
  for (const offset of chunkOffsets(stream)) {
    const type = bytes.toString("latin1", offset + 4, offset + 8);
    const payload = Buffer.from(bytes.subarray(offset + 20, offset + 20 + bytes.readUInt32LE(offset + 12)));
    if (type === "HEAD") payload.writeUInt32LE(features, 2);
    const isSecond = type === "CANO" && ++canonicals === 2;
    parts.push(chunk(isSecond ? "SNAP" : type, parts.length - 1, isSecond ? asSnapshot(payload, canonical) : payload));
  }
  return Uint8Array.from(Buffer.concat(parts));
}

/** The payload of a CANO as one of a SNAP: no survivors, all Gaussians new. */
function asSnapshot(payload: Buffer, canonical: number): Uint8Array {
  const named = Buffer.alloc(4);
  named.writeUInt32LE(canonical);
  return Buffer.concat([payload.subarray(0, 4), named, payload.subarray(4, 21), Buffer.alloc(4), payload.subarray(21)]);
}
