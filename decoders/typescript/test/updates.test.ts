/** Updates of single Gaussians (7.8, 8.8): their planes, their effect on a scene, and the layout of FRAM. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { tabulate } from "../src/columns.js";
import { FEATURE_UPDATES } from "../src/constants.js";
import { decodeStream } from "../src/decode.js";
import { stateDigest } from "../src/digest.js";
import type { StreamHeader } from "../src/header.js";
import { Rejection } from "../src/reject.js";
import type { RejectId } from "../src/reject.js";
import { turn } from "../src/rotation.js";
import type { Scene } from "../src/scene.js";
import { MemorySource } from "../src/source.js";
import { applyUpdates, decodeUpdates, UpdateModels } from "../src/updates.js";
import type { Updates } from "../src/updates.js";
import { chunk, chunkOffsets } from "./edits.js";
import { classPlanes, scripted } from "./script.js";
import { streamBytes, table } from "./spec.js";

const HEADER = { translationStep: 7, rotationUnity: 100, levelCount: 3, rotationComponents: 3 } as StreamHeader;
const ONE = 4194304;

/** `count` Gaussians with 16 codes; Gaussian i is at (10 i, 0, 0) and has recency i mod 4. */
function sceneOf(count: number): Scene {
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

/** Updates of `changed`, whose residuals are 0 except those in `given` (row, index, residual). */
function updatesOf(changed: number[], leaving: number[], ...given: [number, number, number][]): Updates {
  const residuals = Array.from({ length: 13 }, () => new Int32Array(changed.length));
  for (const [row, place, residual] of given) residuals[row][place] = residual;
  return { changed: Uint32Array.from(changed), leaving: Uint32Array.from(leaving), residuals };
}

test("planes are read in the order and contexts of 8.8", () => {
  const models = new UpdateModels();
  const { class: classes, sign } = models.residuals;
  // Gaussians 0 to 4 have motion sums 0, 2, 4, 6, 8 and recencies 0, 1, 2, 3, 0: all but 3 change, and 2 is deleted.
  const section = scripted([
    [models.changes, [0, 9, 14, 15, 12], [1, 1, 1, 0, 1]],
    [models.dies, [0, 1, 2, 0], [0, 0, 1, 0]],
    [models.fields[0], [0, 0, 0], [1, 0, 1]],
    [models.fields[1], [1, 0, 1], [0, 0, 0]],
    [models.fields[2], [1, 0, 1], [0, 0, 0]],
    [models.fields[3], [1, 0, 1], [0, 1, 0]],
    [models.fields[4], [1, 8, 1], [0, 0, 0]],
    // Translation x of Gaussians 0 and 4 is 1 and -1, y is 0 and 1, z is -1 and 0.
    ...classPlanes(classes, [1, 1], [1, 1]),
    [sign, [17, 17], [0, 1]],
    ...classPlanes(classes, [5, 3], [0, 1]),
    [sign, [49], [0]],
    ...classPlanes(classes, [8, 7], [1, 0]),
    [sign, [129], [1]],
    // Opacity of Gaussian 1 is -1.
    ...classPlanes(classes, [28], [1]),
    [sign, [449], [1]],
  ]);
  const updates = decodeUpdates(section, models, sceneOf(5));
  section.finish();

  assert.deepEqual(
    updates,
    updatesOf([0, 1, 4], [2], [0, 0, 1], [0, 2, -1], [1, 2, 1], [2, 0, -1], [9, 1, -1]),
  );
});

test("a section of zeros changes no Gaussian, and has one plane", () => {
  const models = new UpdateModels();
  const section = scripted([[models.changes, [0, 9, 14], [0, 0, 0]]]);
  const updates = decodeUpdates(section, models, sceneOf(3));
  section.finish();

  assert.deepEqual(updates, updatesOf([], []));
});

test("changed Gaussians get residuals and recency 0, deleted ones are removed, and all others stay the same", () => {
  const scene = sceneOf(6);
  const updated = applyUpdates(
    updatesOf([1, 4], [2], [0, 0, 3], [2, 1, -2], [5, 1, 40], [6, 0, -5], [12, 1, 9]),
    scene,
    HEADER,
  );

  assert.deepEqual(Array.from(updated.ids), [0, 5, 15, 20, 25]);
  assert.deepEqual(updated.positions.map((column) => [column[1], column[3]]), [[31, 40], [0, 0], [0, -14]]);
  assert.deepEqual(updated.rotations.map((column) => column[1]), [ONE, 0, 0, 0]);
  assert.deepEqual(updated.rotations.map((column) => column[3]), turn([ONE, 0, 0, 0], [100, 0, 0, 40]));
  assert.deepEqual([updated.codes[0][1], updated.codes[6][3], updated.codes[7][3]], [-4, 613, 704]);
  assert.deepEqual(Array.from(updated.recency), [1, 0, 3, 0, 2]);
  assert.deepEqual(Array.from(updated.binding[0]), [0, 1, 3, 4, 5]);
  assert.deepEqual(Array.from(updated.motion[0]), [0, 1, 3, 4, 5]);
  assert.deepEqual(scene, sceneOf(6));
});

const REFUSED: readonly (readonly [string, RejectId, Updates])[] = [
  ["all Gaussians are deleted", "count", updatesOf([], [0, 1])],
  ["a position is off the lattice", "position-range", updatesOf([1], [], [0, 0, 1198373])],
  ["a code is too large", "code-range", updatesOf([0], [], [6, 0, 32768])],
  ["a negative code is too large", "code-range", updatesOf([0], [], [12, 0, -32767 - 601])],
  ["a rotation is too large", "symbol-range", updatesOf([0], [], [4, 0, -257])],
];

for (const [what, rejectId, updates] of REFUSED) {
  test(`updates are rejected if ${what}: ${rejectId}`, () => {
    assert.throws(() => applyUpdates(updates, sceneOf(2), HEADER), { rejectId });
  });
}

test("updates up to the limits are accepted", () => {
  const updates = updatesOf([0], [1], [1, 0, 1198372], [3, 0, 256], [6, 0, 32767], [12, 0, -32767 - 600]);
  const updated = applyUpdates(updates, sceneOf(2), HEADER);

  assert.deepEqual([updated.positions[1][0], updated.codes[0][0], updated.codes[6][0]], [8388604, 32767, -32767]);
});

test("FRAM has updates if and only if HEAD says so, and empty updates do not change the states", () => {
  for (const name of ["B", "C"]) {
    const digests = table(`digests ${name}`).map((row) => row[5]);

    assert.deepEqual(outcome(rebuilt(name, FEATURE_UPDATES, withoutChanges)), [digests, null]);
    assert.deepEqual(outcome(rebuilt(name, 0, (payload) => payload)), [digests, null]);
    for (const stream of [rebuilt(name, FEATURE_UPDATES, (payload) => payload), rebuilt(name, 0, withoutChanges)])
      assert.notEqual(outcome(stream)[1], null);
  }
});

test("unknown bits of incompatible_features are rejected, even together with that of updates", () => {
  for (const features of [1, 8, 2 ** 31, FEATURE_UPDATES + 1])
    assert.deepEqual(outcome(rebuilt("B", features, withoutChanges)), [[], "unsupported-feature"]);
});

/** The digests of a stream's frames, and the reject id; null if the stream is decoded to its end. */
function outcome(stream: Uint8Array): [string[], RejectId | null] {
  const digests: string[] = [];
  try {
    for (const { state } of decodeStream(new MemorySource(stream))) digests.push(stateDigest(state.scene, state.phase));
    return [digests, null];
  } catch (error) {
    if (error instanceof Rejection) return [digests, error.rejectId];
    throw error;
  }
}

/** A stream of Annex G without its index, with these features and modified payloads of FRAM. */
function rebuilt(name: string, features: number, ofFrame: (payload: Buffer) => Uint8Array): Uint8Array {
  const stream = streamBytes(name);
  const bytes = Buffer.from(stream);
  const parts: Uint8Array[] = [bytes.subarray(0, 8)];
  for (const offset of chunkOffsets(stream)) {
    const type = bytes.toString("latin1", offset + 4, offset + 8);
    const payload = Buffer.from(bytes.subarray(offset + 20, offset + 20 + bytes.readUInt32LE(offset + 12)));
    if (type === "INDX") continue;
    if (type === "HEAD") payload.writeUInt32LE(features, 2);
    if (type === "TAIL") payload.writeBigUInt64LE(0n, 8);
    parts.push(chunk(type, parts.length - 1, type === "FRAM" ? ofFrame(payload) : payload));
  }
  return Buffer.concat(parts);
}

/** Insert a section of updates without words after that of motion into a payload of FRAM. */
function withoutChanges(payload: Buffer): Uint8Array {
  const end = 17 + 4 * payload.readUInt32LE(13);
  return Buffer.concat([payload.subarray(0, end), Buffer.alloc(4), payload.subarray(end)]);
}
