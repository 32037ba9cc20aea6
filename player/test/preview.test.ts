/** What a preview guesses while sections are missing: sizes and opacities from the distances to the neighbors. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { Preview } from "../src/decode/preview.js";
import type { FrameState } from "../src/decode/quarc.js";

const STEPS = { logScaleStep: 0.01, opacityStep: 0.01, latticeExponent: 3 };
const LATTICE_UNIT = 1 / 8;
const POSITIONS_X = [0, 80, 160, 240, 320, 320 + 80 * 50]; // the last has no neighbor nearby
const COUNT = POSITIONS_X.length;

/** A state whose codes are 100 times the column; the columns from 7 on are SH rest. */
const STATE: FrameState = {
  ...{ frame: 7, phase: 0, count: COUNT, ids: new Uint32Array(COUNT) },
  positions: [Int32Array.from(POSITIONS_X), new Int32Array(COUNT).fill(1), new Int32Array(COUNT).fill(2)],
  rotations: [3, 4, 5, 6].map((value) => new Int32Array(COUNT).fill(value)),
  codes: Array.from({ length: 16 }, (_, column) => new Int16Array(COUNT).fill(100 * column)),
};

/** Return the codes of the first and of the last Gaussian. */
function readCodes(sections: number): [number[], number[]] {
  const { codes } = new Preview().makePacket(STATE, sections, STEPS);
  return [[...codes.subarray(0, 7)], [...codes.subarray(16 * (COUNT - 1), 16 * (COUNT - 1) + 7)]];
}

test("a preview has the positions, rotations and colors of the frame", () => {
  const { frame, slotLimit, movedSlots, codedSlots, positions, rotations, codes } = new Preview().makePacket(STATE, 5, STEPS);
  assert.deepEqual([frame, slotLimit, [...movedSlots], [...codedSlots]], [7, 6, [0, 1, 2, 3, 4, 5], [0, 1, 2, 3, 4, 5]]);
  assert.deepEqual([...positions.subarray(3, 6), ...rotations.subarray(4, 8)], [80, 1, 2, 3, 4, 5, 6]);
  assert.deepEqual([...codes.subarray(16, 32)], [0, 100, 200, 300, 400, 500, 600, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
});

test("a guessed standard deviation is half the distance to the nearest neighbor, up to a limit", () => {
  const deviation = 0.5 * 80 * LATTICE_UNIT;
  const code = Math.round(Math.log(deviation) / STEPS.logScaleStep);
  const [first, last] = readCodes(3); // with the opacities
  assert.deepEqual(first, [code, code, code, 300, 400, 500, 600]);
  const maxCode = Math.round(Math.log(6 * deviation) / STEPS.logScaleStep);
  assert.deepEqual(last, [maxCode, maxCode, maxCode, 300, 400, 500, 600]);
});

test("without opacities, large Gaussians are smaller and almost transparent", () => {
  const code = Math.round(Math.log(2 * 0.5 * 80 * LATTICE_UNIT) / STEPS.logScaleStep);
  const [first, last] = readCodes(2);
  assert.equal(first[3], 200, "an opacity of 0.88");
  assert.deepEqual(last.slice(0, 4), [code, code, code, -600]);
});

test("without rotations, Gaussians are spheres", () => {
  assert.deepEqual(readCodes(4)[0], [100, 100, 100, 300, 400, 500, 600]);
});
