/** Snapshots (7.9, 8.9): their planes, their differences to a CANO, and streams with snapshots (5.10, 11). */

import assert from "node:assert/strict";
import { test } from "node:test";
import type { CanonicalGaussians } from "../src/canonical.js";
import { tabulate } from "../src/columns.js";
import { FEATURE_SNAPSHOTS } from "../src/constants.js";
import { decodeStream } from "../src/decode.js";
import { digestState } from "../src/digest.js";
import type { StreamHeader } from "../src/header.js";
import { Rejection } from "../src/reject.js";
import type { RejectId } from "../src/reject.js";
import { seekStream } from "../src/seek.js";
import { applyDifferences, decodeSurvivors, sortGaussians, SurvivorModels } from "../src/snapshots.js";
import type { Survivors } from "../src/snapshots.js";
import { MemorySource } from "../src/source.js";
import { changeByte, makeChunk, findChunkOffsets } from "./edits.js";
import { listRecoveredParts } from "./recovered.js";
import { makeClassPlanes, makeScriptedSection } from "./script.js";
import { readStream, readTable } from "./spec.js";

const HEADER = { positionStep: 4, rotationBits: 8 } as StreamHeader;

/** Make `count` Gaussians with 16 codes; Gaussian i is at (10 i, 0, 0) and has the rotation i mod 4, (1, 2, i). */
function makeGaussians(count: number): CanonicalGaussians {
  const rows = (length: number, value: (row: number, i: number) => number) =>
    Array.from({ length }, (_, row) => tabulate(count, (i) => value(row, i)));
  return {
    positions: rows(3, (row, i) => (row === 0 ? 10 * i : 0)),
    codedRotations: {
      indices: Uint8Array.from({ length: count }, (_, i) => i % 4),
      components: rows(3, (row, i) => [1, 2, i][row]),
    },
    rotations: rows(4, () => 0),
    codes: rows(16, (row, i) => 100 * row + i),
  };
}

/** Make survivors whose differences are 0 except `nonzeroDifferences` (row, index, difference). */
function makeSurvivors(indices: number[], ...nonzeroDifferences: [number, number, number][]): Survivors {
  const differences = Array.from({ length: 14 }, () => new Int32Array(indices.length));
  for (const [row, place, difference] of nonzeroDifferences) differences[row][place] = difference;
  return { indices: Uint32Array.from(indices), differences };
}

test("planes are read in the order and contexts of 8.9", () => {
  const models = new SurvivorModels();
  const { class: classes, sign } = models.differences;
  // Of Gaussians 0 to 3, all but 1 survive: 0 and 3 with position, 2 with rotation, 3 with opacity.
  const section = makeScriptedSection([
    [models.survives, [0, 0, 0, 0], [1, 0, 1, 1]],
    [models.fields[0], [0, 0, 0], [1, 0, 1]],
    [models.fields[1], [1, 0, 1], [0, 1, 0]],
    [models.fields[2], [1, 2, 1], [0, 0, 0]],
    [models.fields[3], [1, 2, 1], [0, 0, 1]],
    [models.fields[4], [1, 2, 9], [0, 0, 0]],
    // x: 1, and 1 less; y: 0 and 1; z: 0 and -1, after sums of 1 and 2.
    ...makeClassPlanes(classes, [0, 0], [1, 1]),
    [sign, [1, 1], [0, 1]],
    ...makeClassPlanes(classes, [9, 9], [0, 1]),
    [sign, [145], [0]],
    ...makeClassPlanes(classes, [17, 18], [0, 1]),
    [sign, [289], [1]],
    // j: 2; a: -1, b: 1, c: 0, after sums of 0, 1 and 2, which do not include j.
    [models.index.class, [1], [1]],
    [models.index.class, [3], [0]],
    ...makeClassPlanes(classes, [32], [1]),
    [sign, [513], [1]],
    ...makeClassPlanes(classes, [41], [1]),
    [sign, [657], [0]],
    ...makeClassPlanes(classes, [50], [0]),
    // Opacity: 1.
    ...makeClassPlanes(classes, [80], [1]),
    [sign, [1281], [0]],
  ]);
  const survivors = decodeSurvivors(section, models, 4);
  section.finish();

  const positionDifferences: [number, number, number][] = [
    [0, 0, 1],
    [0, 2, 0],
    [1, 2, 1],
    [2, 2, -1],
  ];
  assert.deepEqual(
    survivors,
    makeSurvivors([0, 2, 3], ...positionDifferences, [3, 1, 2], [4, 1, -1], [5, 1, 1], [10, 2, 1]),
  );
});

test("differences are added, except to the components of a rotation whose index changes", () => {
  const gaussians = makeGaussians(4);
  const changedGaussians = applyDifferences(
    makeSurvivors([1, 3], [0, 0, -3], [2, 1, 5], [3, 1, 3], [4, 0, 7], [4, 1, 9], [10, 0, -1], [13, 1, 6]),
    gaussians,
    HEADER,
  );

  assert.deepEqual(
    changedGaussians.positions.map((row) => Array.from(row)),
    [
      [7, 30],
      [0, 0],
      [0, 5],
    ],
  );
  assert.deepEqual(Array.from(changedGaussians.codedRotations.indices), [1, 2]);
  assert.deepEqual(
    changedGaussians.codedRotations.components.map((row) => Array.from(row)),
    [
      [8, 9],
      [2, 0],
      [1, 0],
    ],
  );
  assert.deepEqual(
    [changedGaussians.codes[3][0], changedGaussians.codes[6][1], changedGaussians.codes[7][1]],
    [300, 609, 703],
  );
  assert.deepEqual(gaussians, makeGaussians(4));
});

const REJECTED_CASES: readonly (readonly [string, RejectId, Survivors])[] = [
  ["a position is off the lattice", "position-range", makeSurvivors([0], [1, 0, 2097152])],
  ["a code is too large", "code-range", makeSurvivors([1], [11, 0, 32767])],
  ["a rotation component is too large", "rotation-range", makeSurvivors([0], [4, 0, 256])],
];

for (const [reason, rejectId, survivors] of REJECTED_CASES) {
  test(`survivors are rejected if ${reason}: ${rejectId}`, () => {
    assert.throws(() => applyDifferences(survivors, makeGaussians(2), HEADER), { rejectId });
  });
}

test("Gaussians are sorted stably by Morton keys relative to their minimum, and must not be too far apart", () => {
  const makeGaussiansAt = (...x: number[]) => ({
    ...makeGaussians(x.length),
    positions: [x, x, x].map((row) => Int32Array.from(row)),
  });
  const sortedGaussians = sortGaussians(makeGaussiansAt(3, -5, 0, -5, 2));

  assert.deepEqual(Array.from(sortedGaussians.positions[0]), [-5, -5, 0, 2, 3]);
  assert.deepEqual(Array.from(sortedGaussians.codes[0]), [1, 3, 2, 4, 0]);
  assert.equal(sortGaussians(makeGaussiansAt(-1, 2 ** 20 - 2)).positions[0][1], 2 ** 20 - 2);
  assert.throws(() => sortGaussians(makeGaussiansAt(-1, 2 ** 20 - 1)), { rejectId: "symbol-range" });
});

/** Stream C (frames 1000 to 1006), with the last canonical frame replaced by a snapshot without survivors. */
const STREAM_C = replaceBySnapshot(readStream("C"), FEATURE_SNAPSHOTS, 1000);
const [, , , SECOND_OFFSET, , , SNAPSHOT_OFFSET, , TAIL_OFFSET] = findChunkOffsets(STREAM_C);
const DIGESTS = new Map(readTable("digests C").map((row) => [Number(row[0]), row[5]]));
const ORDINALS = [...DIGESTS.keys()];

test("a snapshot has the same state as a CANO of the same Gaussians", () => {
  assert.deepEqual(
    decodeAll(() => decodeStream(new MemorySource(STREAM_C))),
    [ORDINALS, null],
  );
});

test("seeking to a snapshot decodes its CANO without returning it", () => {
  for (let start = 998; start < 1009; start++) {
    const expected = ORDINALS.filter((ordinal) => ordinal >= start);
    assert.deepEqual(
      decodeAll(() => seekStream(STREAM_C, start)),
      [expected, null],
    );
    const truncatedStream = STREAM_C.subarray(0, TAIL_OFFSET);
    assert.deepEqual(
      decodeAll(() => seekStream(truncatedStream, start)),
      [expected, "truncated"],
    );
  }
  const otherStream = replaceBySnapshot(readStream("C"), FEATURE_SNAPSHOTS, 999);
  assert.deepEqual(
    decodeAll(() => seekStream(otherStream, 1006)),
    [[], "index-mismatch"],
  );
});

test("seeking works with and without INDX", () => {
  const stream = readStream("B");
  for (let start = 0; start < 5; start++) {
    const expected = [0, 1, 2, 3].filter((ordinal) => ordinal >= start);
    assert.deepEqual(listOrdinals(seekStream(stream, start)), expected);
  }
  const offset = findChunkOffsets(stream).at(-2) ?? 0;
  assert.throws(() => listOrdinals(seekStream(changeByte(stream, offset), 1)), { rejectId: "index-mismatch" });
  assert.throws(() => listOrdinals(seekStream(changeByte(stream, offset + 20), 1)), { rejectId: "payload-crc" });
});

test("decoding resumes only at a snapshot whose CANO has been decoded", () => {
  const expectedGap = [SECOND_OFFSET, SNAPSHOT_OFFSET - SECOND_OFFSET, "payload-crc", 3] as const;
  assert.deepEqual(listRecoveredParts(changeByte(STREAM_C, SECOND_OFFSET + 20), DIGESTS), [
    1000,
    1001,
    expectedGap,
    1005,
    1006,
  ]);

  const otherStream = changeByte(replaceBySnapshot(readStream("C"), FEATURE_SNAPSHOTS, 999), SECOND_OFFSET + 20);
  assert.deepEqual(listRecoveredParts(otherStream), [
    1000,
    1001,
    [SECOND_OFFSET, TAIL_OFFSET - SECOND_OFFSET, "payload-crc", 5],
  ]);
});

test("a snapshot must refer to the last CANO, and needs its feature in HEAD", () => {
  const ordinalsBefore = ORDINALS.slice(0, 5);
  const decodeWith = (features: number, canonical: number) =>
    decodeAll(() => decodeStream(new MemorySource(replaceBySnapshot(readStream("C"), features, canonical))));

  assert.deepEqual(decodeWith(FEATURE_SNAPSHOTS, 1001), [ordinalsBefore, "frame-order"]);
  assert.deepEqual(decodeWith(0, 1000), [ordinalsBefore, "unknown-critical"]);
});

/**
 * Decode frames and check their digests; return the ordinals, and the reject id or null.
 */
function decodeAll(frames: () => Iterable<{ state: Parameters<typeof checkDigest>[0] }>): [number[], RejectId | null] {
  const nonzeroDifferences: number[] = [];
  try {
    for (const { state } of frames()) nonzeroDifferences.push(checkDigest(state));
    return [nonzeroDifferences, null];
  } catch (error) {
    if (error instanceof Rejection) return [nonzeroDifferences, error.rejectId];
    throw error;
  }
}

function checkDigest(state: { ordinal: number; phase: number; scene: Parameters<typeof digestState>[0] }): number {
  assert.equal(digestState(state.scene, state.phase), DIGESTS.get(state.ordinal));
  return state.ordinal;
}

function listOrdinals(frames: ReturnType<typeof seekStream>): number[] {
  return [...frames].map(({ state }) => state.ordinal);
}

/** Replace the second CANO of a stream by a snapshot against frame `canonical`, and set the features in HEAD. */
function replaceBySnapshot(stream: Uint8Array, features: number, canonical: number): Uint8Array {
  const bytes = Buffer.from(stream);
  const chunks: Uint8Array[] = [bytes.subarray(0, 8)];
  let canonicalCount = 0;
  for (const offset of findChunkOffsets(stream)) {
    const type = bytes.toString("latin1", offset + 4, offset + 8);
    const payload = Buffer.from(bytes.subarray(offset + 20, offset + 20 + bytes.readUInt32LE(offset + 12)));
    if (type === "HEAD") payload.writeUInt32LE(features, 2);
    const isSecond = type === "CANO" && ++canonicalCount === 2;
    chunks.push(
      makeChunk(
        isSecond ? "SNAP" : type,
        chunks.length - 1,
        isSecond ? makeSnapshotPayload(payload, canonical) : payload,
      ),
    );
  }
  return Uint8Array.from(Buffer.concat(chunks));
}

/** Convert the payload of a CANO to that of a SNAP without survivors, in which all Gaussians are new. */
function makeSnapshotPayload(payload: Buffer, canonical: number): Uint8Array {
  const canonicalBytes = Buffer.alloc(4);
  canonicalBytes.writeUInt32LE(canonical);
  return Buffer.concat([
    payload.subarray(0, 4),
    canonicalBytes,
    payload.subarray(4, 21),
    Buffer.alloc(4),
    payload.subarray(21),
  ]);
}
