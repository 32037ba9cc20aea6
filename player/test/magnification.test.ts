/** The size of a picture relative to the pictures of the capture. */

import assert from "node:assert/strict";
import { test } from "node:test";
import type { Eye } from "../src/draw/eye.js";
import { measureMagnification } from "../src/draw/magnification.js";

/** Make an eye at x = `x`, which looks along z. */
const makeEye = (fx: number, fy: number, x = 0): Eye =>
  ({ ...{ fx, fy, rotation: [1, 0, 0, 0, 1, 0, 0, 0, 1] }, translation: [-x, 0, 0] }) as unknown as Eye;

test("a picture is magnified by how far its focal lengths are outside the range of the capture", () => {
  const cameras = [makeEye(400, 100), makeEye(800, 200)];
  const magnify = (fx: number, fy: number): number[] => {
    const { x, y } = measureMagnification(makeEye(fx, fy), cameras);
    return [x, y];
  };
  assert.deepEqual([magnify(1600, 50), magnify(600, 150), magnify(100, 800)], [[2, 0.5], [1, 1], [0.25, 4]]);
  const { x, y, center } = measureMagnification(makeEye(5, 7, 3), []);
  assert.deepEqual([x, y, center[0]], [1, 1, 3]);
});

test("the nearest cameras weigh most in the center of the capture", () => {
  const findCenter = (x: number, ...others: number[]): number =>
    measureMagnification(makeEye(1, 1, x), others.map((other) => makeEye(1, 1, other))).center[0];
  assert.equal(findCenter(0, -1, 1), 0);
  assert.equal(findCenter(2, 2, 9), 2);
  const center = findCenter(0, 1, 2);
  assert.ok(Math.abs(center - (1 + 2 ** -7) / (1 + 2 ** -8)) < 1e-12, `${center}`);
});
