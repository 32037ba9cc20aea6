/** The up vector comes from the request, the header, the metadata key `up`, or the cameras, in this order. */

import assert from "node:assert/strict";
import { test } from "node:test";
import type { CaptureCamera, StreamInfo } from "../src/protocol.js";
import { findUp } from "../src/view/scene.js";

const UNKNOWN_AXIS = 0;
const MINUS_Z_AXIS = 6; // -z in the header

/** Make a camera that looks along z and whose y axis is `down`. */
const makeCamera = (down: readonly [number, number]): CaptureCamera => {
  const [x, y] = down;
  return { rotation: [y, -x, 0, x, y, 0, 0, 0, 1] } as unknown as CaptureCamera;
};

const makeInfo = (up: string | null, upAxis = UNKNOWN_AXIS, cameras: readonly CaptureCamera[] = []): StreamInfo =>
  ({ upAxis, cameras, metadata: up === null ? {} : { up } }) as unknown as StreamInfo;

const assertNear = (actual: readonly number[], expected: readonly number[]): void =>
  actual.forEach((value, axis) => assert.ok(Math.abs(value - (expected[axis] ?? NaN)) < 1e-6, `${actual}; expected ${expected}`));

test("the metadata key up gives a direction of any length", () => {
  assertNear(findUp(makeInfo("0 -3 4"), null), [0, -0.6, 0.8]);
  assertNear(findUp(makeInfo(" 1e-3\t0 0 "), null), [1, 0, 0]);
});

test("the header has precedence over the metadata, and a requested axis over both", () => {
  assertNear(findUp(makeInfo("0 1 0", MINUS_Z_AXIS), null), [0, 0, -1]);
  assertNear(findUp(makeInfo("0 1 0", MINUS_Z_AXIS), "-x"), [-1, 0, 0]);
});

test("without a valid direction in the metadata, up is the mean of the cameras' up vectors", () => {
  const cameras = [makeCamera([0.6, 0.8]), makeCamera([-0.6, 0.8])];
  for (const text of [null, "", "up", "0 0 0", "1 2", "1 2 3 4", "0 NaN 1", "0 Infinity 0"]) {
    assertNear(findUp(makeInfo(text, UNKNOWN_AXIS, cameras), null), [0, -1, 0]);
  }
});

test("up is y by default", () => {
  assertNear(findUp(makeInfo(null), null), [0, 1, 0]);
});
