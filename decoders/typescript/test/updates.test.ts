/** Updates of individual Gaussians (7.8, 8.8): their planes, their effect on a scene, and their section in FRAM. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { tabulate } from "../src/columns.js";
import { FEATURE_UPDATES } from "../src/constants.js";
import { decodeStream } from "../src/decode.js";
import { digestState } from "../src/digest.js";
import type { StreamHeader } from "../src/header.js";
import { Rejection } from "../src/reject.js";
import type { RejectId } from "../src/reject.js";
import { rotate } from "../src/rotation.js";
import type { Scene } from "../src/scene.js";
import { MemorySource } from "../src/source.js";
import { applyUpdates, decodeUpdates, UpdateModels } from "../src/updates.js";
import type { Updates } from "../src/updates.js";
import { makeChunk, findChunkOffsets } from "./edits.js";
import { makeClassPlanes, makeScriptedSection } from "./script.js";
import { readStream, readTable } from "./spec.js";

const HEADER = { translationStep: 7, rotationUnity: 100, levelCount: 3, rotationComponents: 3 } as StreamHeader;
const ONE = 4194304;

/** Make a scene of `count` Gaussians with 16 codes; Gaussian i is at (10 i, 0, 0) and has recency i mod 4. */
function makeScene(count: number): Scene {
  const rows = (length: number, value: (row: number, i: number) => number) =>
    Array.from({ length }, (_, row) => tabulate(count, (i) => value(row, i)));
  return {
    ids: Uint32Array.from({ length: count }, (_, i) => 5 * i),
    positions: rows(3, (row, i) => (row === 0 ? 10 * i : 0)),
    rotations: rows(4, (row) => (row === 0 ? ONE : 0)),
    codes: rows(16, (row, i) => 100 * row + i),
    motion: rows(6, (row, i) => (row < 2 ? i : 0)),
    binding: rows(1, (_, i) => i),
    recency: tabulate(count, (i) => i % 4),
  };
}

/** Make updates of `changedIndices`, whose residuals are 0 except `nonzeroResiduals` (row, index, residual). */
function makeUpdates(
  changedIndices: number[],
  deletedIndices: number[],
  ...nonzeroResiduals: [number, number, number][]
): Updates {
  const residuals = Array.from({ length: 13 }, () => new Int32Array(changedIndices.length));
  for (const [row, index, residual] of nonzeroResiduals) residuals[row][index] = residual;
  return {
    changedIndices: Uint32Array.from(changedIndices),
    deletedIndices: Uint32Array.from(deletedIndices),
    residuals,
  };
}

test("planes are read in the order and contexts of 8.8", () => {
  const models = new UpdateModels();
  const { class: classes, sign } = models.residuals;
  // Gaussians 0 to 4 have motion sums 0, 2, 4, 6, 8 and recencies 0, 1, 2, 3, 0: all but 3 change, and 2 is deleted.
  const section = makeScriptedSection([
    [models.changes, [0, 9, 14, 15, 12], [1, 1, 1, 0, 1]],
    [models.isDeleted, [0, 1, 2, 0], [0, 0, 1, 0]],
    [models.fields[0], [0, 0, 0], [1, 0, 1]],
    [models.fields[1], [1, 0, 1], [0, 0, 0]],
    [models.fields[2], [1, 0, 1], [0, 0, 0]],
    [models.fields[3], [1, 0, 1], [0, 1, 0]],
    [models.fields[4], [1, 8, 1], [0, 0, 0]],
    // Translation x of Gaussians 0 and 4 is 1 and -1, y is 0 and 1, z is -1 and 0.
    ...makeClassPlanes(classes, [1, 1], [1, 1]),
    [sign, [17, 17], [0, 1]],
    ...makeClassPlanes(classes, [5, 3], [0, 1]),
    [sign, [49], [0]],
    ...makeClassPlanes(classes, [8, 7], [1, 0]),
    [sign, [129], [1]],
    // Opacity of Gaussian 1 is -1.
    ...makeClassPlanes(classes, [28], [1]),
    [sign, [449], [1]],
  ]);
  const updates = decodeUpdates(section, models, makeScene(5));
  section.finish();

  assert.deepEqual(updates, makeUpdates([0, 1, 4], [2], [0, 0, 1], [0, 2, -1], [1, 2, 1], [2, 0, -1], [9, 1, -1]));
});

test("a section of zeros changes no Gaussian, and has one plane", () => {
  const models = new UpdateModels();
  const section = makeScriptedSection([[models.changes, [0, 9, 14], [0, 0, 0]]]);
  const updates = decodeUpdates(section, models, makeScene(3));
  section.finish();

  assert.deepEqual(updates, makeUpdates([], []));
});

test("updates add residuals, reset recency and delete Gaussians; all other Gaussians stay the same", () => {
  const scene = makeScene(6);
  const updated = applyUpdates(
    makeUpdates([1, 4], [2], [0, 0, 3], [2, 1, -2], [5, 1, 40], [6, 0, -5], [12, 1, 9]),
    scene,
    HEADER,
  );

  assert.deepEqual(Array.from(updated.ids), [0, 5, 15, 20, 25]);
  assert.deepEqual(
    updated.positions.map((column) => [column[1], column[3]]),
    [
      [31, 40],
      [0, 0],
      [0, -14],
    ],
  );
  assert.deepEqual(
    updated.rotations.map((column) => column[1]),
    [ONE, 0, 0, 0],
  );
  assert.deepEqual(
    updated.rotations.map((column) => column[3]),
    rotate([ONE, 0, 0, 0], [100, 0, 0, 40]),
  );
  assert.deepEqual([updated.codes[0][1], updated.codes[6][3], updated.codes[7][3]], [-4, 613, 704]);
  assert.deepEqual(Array.from(updated.recency), [1, 0, 3, 0, 2]);
  assert.deepEqual(Array.from(updated.binding[0]), [0, 1, 3, 4, 5]);
  assert.deepEqual(Array.from(updated.motion[0]), [0, 1, 3, 4, 5]);
  assert.deepEqual(scene, makeScene(6));
});

const REJECTED_CASES: readonly (readonly [string, RejectId, Updates])[] = [
  ["all Gaussians are deleted", "count", makeUpdates([], [0, 1])],
  ["a position is off the lattice", "position-range", makeUpdates([1], [], [0, 0, 1198373])],
  ["a code is too large", "code-range", makeUpdates([0], [], [6, 0, 32768])],
  ["a negative code is too large", "code-range", makeUpdates([0], [], [12, 0, -32767 - 601])],
  ["a rotation is too large", "symbol-range", makeUpdates([0], [], [4, 0, -257])],
];

for (const [reason, rejectId, updates] of REJECTED_CASES) {
  test(`updates are rejected if ${reason}: ${rejectId}`, () => {
    assert.throws(() => applyUpdates(updates, makeScene(2), HEADER), { rejectId });
  });
}

test("updates up to the limits are accepted", () => {
  const updates = makeUpdates([0], [1], [1, 0, 1198372], [3, 0, 256], [6, 0, 32767], [12, 0, -32767 - 600]);
  const updated = applyUpdates(updates, makeScene(2), HEADER);

  assert.deepEqual([updated.positions[1][0], updated.codes[0][0], updated.codes[6][0]], [8388604, 32767, -32767]);
});

test("FRAM has updates if and only if HEAD says so, and empty updates do not change the states", () => {
  for (const name of ["B", "C"]) {
    const digests = readTable(`digests ${name}`).map((row) => row[5]);

    assert.deepEqual(decodeAll(rebuildStream(name, FEATURE_UPDATES, insertEmptyUpdates)), [digests, null]);
    assert.deepEqual(decodeAll(rebuildStream(name, 0, (payload) => payload)), [digests, null]);
    for (const stream of [
      rebuildStream(name, FEATURE_UPDATES, (payload) => payload),
      rebuildStream(name, 0, insertEmptyUpdates),
    ])
      assert.notEqual(decodeAll(stream)[1], null);
  }
});

test("unknown bits of incompatible_features are rejected, even together with that of updates", () => {
  for (const features of [1, 8, 2 ** 31, FEATURE_UPDATES + 1])
    assert.deepEqual(decodeAll(rebuildStream("B", features, insertEmptyUpdates)), [[], "unsupported-feature"]);
});

/** Decode a stream; return the digests of its frames, and the reject id or null. */
function decodeAll(stream: Uint8Array): [string[], RejectId | null] {
  const digests: string[] = [];
  try {
    for (const { state } of decodeStream(new MemorySource(stream))) digests.push(digestState(state.scene, state.phase));
    return [digests, null];
  } catch (error) {
    if (error instanceof Rejection) return [digests, error.rejectId];
    throw error;
  }
}

/** Rebuild a stream of Annex G without its index, with other features and edited payloads of FRAM. */
function rebuildStream(name: string, features: number, editFramePayload: (payload: Buffer) => Uint8Array): Uint8Array {
  const stream = readStream(name);
  const bytes = Buffer.from(stream);
  const chunks: Uint8Array[] = [bytes.subarray(0, 8)];
  for (const offset of findChunkOffsets(stream)) {
    const type = bytes.toString("latin1", offset + 4, offset + 8);
    const payload = Buffer.from(bytes.subarray(offset + 20, offset + 20 + bytes.readUInt32LE(offset + 12)));
    if (type === "INDX") continue;
    if (type === "HEAD") payload.writeUInt32LE(features, 2);
    if (type === "TAIL") payload.writeBigUInt64LE(0n, 8);
    chunks.push(makeChunk(type, chunks.length - 1, type === "FRAM" ? editFramePayload(payload) : payload));
  }
  return Buffer.concat(chunks);
}

/** Insert an empty section of updates into a payload of FRAM, after the section of motion. */
function insertEmptyUpdates(payload: Buffer): Uint8Array {
  const end = 17 + 4 * payload.readUInt32LE(13);
  return Buffer.concat([payload.subarray(0, end), Buffer.alloc(4), payload.subarray(end)]);
}
