/** Dequantizes the state of a frame to binary32 numbers (SPEC 10.1). No state depends on these numbers. */

import { createHash } from "node:crypto";
import { LOG_SCALE_PLANES, OPACITY_PLANES, ROTATION_ONE, SH_DC_PLANES, SH_REST_PLANES } from "./constants.js";
import type { StreamHeader } from "./header.js";
import type { CodedScene } from "./scene.js";

/** Return code x step in binary32. The product has at most 40 significant bits, so a double represents it exactly. */
export function dequantize(code: number, step: number): number {
  return Math.fround(code * step);
}

/** Generate all numbers, column by column, in the order of the serialization. */
export function* dequantizeScene(scene: CodedScene, header: StreamHeader): Generator<Float32Array> {
  for (const column of scene.positions) yield dequantizeColumn(column, 2 ** -header.latticeExponent);
  for (const column of scene.rotations) yield dequantizeColumn(column, 1 / ROTATION_ONE);
  const steps = listRowSteps(header);
  for (const [row, codes] of scene.codes.entries()) yield dequantizeColumn(codes, steps[row]);
}

/** Return the SHA-256 of all numbers as little-endian binary32, in hexadecimal. */
export function digestNumbers(scene: CodedScene, header: StreamHeader): string {
  const hash = createHash("sha256");
  for (const numbers of dequantizeScene(scene, header)) hash.update(toBytes(numbers));
  return hash.digest("hex");
}

function listRowSteps(header: StreamHeader): number[] {
  return [
    ...new Array<number>(LOG_SCALE_PLANES).fill(header.logScaleStep),
    ...new Array<number>(OPACITY_PLANES).fill(header.opacityStep),
    ...new Array<number>(SH_DC_PLANES).fill(header.shDcStep),
    ...new Array<number>(SH_REST_PLANES).fill(header.shRestStep),
  ];
}

function dequantizeColumn(column: Int32Array, step: number): Float32Array {
  return new Float32Array(column.length).map((_, i) => dequantize(column[i], step));
}

function toBytes(numbers: Float32Array): Uint8Array {
  const view = new DataView(new ArrayBuffer(4 * numbers.length));
  numbers.forEach((number, i) => view.setFloat32(4 * i, number, true));
  return new Uint8Array(view.buffer);
}
