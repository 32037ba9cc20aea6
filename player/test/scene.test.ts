/** The up vector: the requested one, the header, the metadata key `up`, or the cameras, in this order. */

import assert from "node:assert/strict";
import { test } from "node:test";
import type { CaptureCamera, StreamInfo } from "../src/protocol.js";
import { findUp } from "../src/view/scene.js";

const UNKNOWN = 0;
const DOWN_Z = 6; // -z in the header

/** A camera that looks along z, rotated so that its y axis, which points down, is `down`. */
const turned = (down: readonly [number, number]): CaptureCamera => {
  const [x, y] = down;
  return { rotation: [y, -x, 0, x, y, 0, 0, 0, 1] } as unknown as CaptureCamera;
};

const describe = (up: string | null, upAxis = UNKNOWN, cameras: readonly CaptureCamera[] = []): StreamInfo =>
  ({ upAxis, cameras, metadata: up === null ? {} : { up } }) as unknown as StreamInfo;

const near = (found: readonly number[], due: readonly number[]): void =>
  found.forEach((value, k) => assert.ok(Math.abs(value - (due[k] ?? NaN)) < 1e-6, `${found}; expected ${due}`));

test("the metadata key up gives a direction of any length", () => {
  near(findUp(describe("0 -3 4"), null), [0, -0.6, 0.8]);
  near(findUp(describe(" 1e-3\t0 0 "), null), [1, 0, 0]);
});

test("the header has precedence over the metadata, and a requested axis over both", () => {
  near(findUp(describe("0 1 0", DOWN_Z), null), [0, 0, -1]);
  near(findUp(describe("0 1 0", DOWN_Z), "-x"), [-1, 0, 0]);
});

test("metadata without a direction is ignored: up is then the mean of the cameras'", () => {
  const cameras = [turned([0.6, 0.8]), turned([-0.6, 0.8])];
  for (const text of [null, "", "up", "0 0 0", "1 2", "1 2 3 4", "0 NaN 1", "0 Infinity 0"]) {
    near(findUp(describe(text, UNKNOWN, cameras), null), [0, -1, 0]);
  }
});

test("up is y by default", () => {
  near(findUp(describe(null), null), [0, 1, 0]);
});
