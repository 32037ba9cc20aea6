/** The structures of core/capi/include/quarc.h, read from memory in which every field has another value. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { readCamera, readHead } from "../src/decode/layout.js";

const ADDRESS = 8;

/** Write numbers of 32 bits one after the other; those in `integerFields` are integers. */
function writeFields(values: readonly number[], integerFields: readonly number[]): DataView {
  const memory = new DataView(new ArrayBuffer(ADDRESS + 4 * values.length));
  values.forEach((value, field) => {
    if (integerFields.includes(field)) memory.setUint32(ADDRESS + 4 * field, value, true);
    else memory.setFloat32(ADDRESS + 4 * field, value, true);
  });
  return memory;
}

test("the fields of quarc_head_info", () => {
  const memory = writeFields([30000, 1001, 20, 12, 0.5, 0.25, 0.125, 0.0625, 1, 1, 4, 2.5, 0], [0, 1, 2, 3, 8, 9, 10, 12]);
  assert.deepEqual(readHead(memory, ADDRESS), {
    ...{ timescale: 30000, frameTicks: 1001, latticeExponent: 12 },
    ...{ logScaleStep: 0.5, opacityStep: 0.25, shDcStep: 0.125, shRestStep: 0.0625 },
    ...{ shDegree: 1, isRightHanded: true, upAxis: 4, metersPerUnit: 2.5 },
  });
});

test("the fields of quarc_camera_info", () => {
  const [rotation, translation] = [[11, 12, 13, 21, 22, 23, 31, 32, 33], [41, 42, 43]];
  const memory = writeFields([0, 0, 1, 640, 480, 500, 501, 320.5, 240.5, ...rotation, ...translation, 0.5], [0, 1, 2, 3, 4]);
  assert.deepEqual(readCamera(memory, ADDRESS, "front"), {
    ...{ name: "front", isHeldOut: true, width: 640, height: 480, fx: 500, fy: 501, cx: 320.5, cy: 240.5 },
    ...{ rotation, translation, near: 0.5 },
  });
});
