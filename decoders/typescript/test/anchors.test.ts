/** Sampling and binding match the example of F.7; the search matches a search by brute force. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { sampleAndBind } from "../src/anchors.js";
import type { StreamHeader } from "../src/header.js";
import { AnchorSearch } from "../src/nearest.js";
import type { Point } from "../src/nearest.js";
import { philox } from "../src/philox.js";
import { computeAnchorCounts } from "../src/sampler.js";
import { makeScene } from "../src/scene.js";
import { parseIntegers, readSamplerExample } from "./spec.js";

const HEADER = {
  seed: 7n,
  levelCount: 1,
  gaussiansPerAnchor: 2,
  anchorRatio: 2,
  rotationComponents: 3,
} as StreamHeader;

test("anchors and bindings match F.7", () => {
  const exampleRows = readSamplerExample();
  const points = exampleRows.map(([, position]) => parseIntegers(position));
  const scene = makeScene(
    {
      ids: Uint32Array.from(exampleRows, ([id]) => Number(id)),
      positions: [0, 1, 2].map((axis) => Int32Array.from(points, (point) => point[axis])),
      rotations: [],
      codes: [],
    },
    HEADER,
    0,
  );
  const [[level], boundScene] = sampleAndBind(scene, 3, HEADER);

  assert.deepEqual(
    Array.from(level.ids, String),
    exampleRows.filter((row) => row[4] !== "no").map(([id]) => id),
  );
  assert.deepEqual(
    Array.from(boundScene.binding[0], String),
    exampleRows.map((row) => row[5]),
  );
});

test("40 Gaussians have 10, 3 and 1 anchors, as in 6.1", () => {
  const header = { ...HEADER, levelCount: 3, gaussiansPerAnchor: 4, anchorRatio: 3 };

  assert.deepEqual(computeAnchorCounts(40, header), [10, 3, 1]);
});

test("the search finds the anchor with the lowest (distance, index), even among ties", () => {
  for (const width of [1, 3, 10, 1000]) {
    const anchors = [0, 1, 2].map((axis) => Int32Array.from({ length: 200 }, (_, i) => drawCoordinate(i, axis, width)));
    const search = new AnchorSearch(anchors);
    for (let i = 1000; i < 1300; i++) {
      const point = [drawCoordinate(i, 0, width), drawCoordinate(i, 1, width), drawCoordinate(i, 2, width)] as const;

      assert.equal(search.findNearest(point), findNearestByBruteForce(anchors, point));
    }
  }
});

function findNearestByBruteForce(anchors: readonly Int32Array[], point: Point): number {
  const distances = Array.from(anchors[0], (_, anchor) =>
    anchors.reduce((sum, column, axis) => sum + (column[anchor] - point[axis]) ** 2, 0),
  );
  return distances.indexOf(Math.min(...distances));
}

function drawCoordinate(index: number, axis: number, width: number): number {
  return philox([index, axis, width, 0], [0, 0])[0] % width;
}
