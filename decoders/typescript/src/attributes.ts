/** Attributes that canonical and new Gaussians code in the same way: rows, codes, rotations (SPEC 7.2, 8.5, 8.6). */

import { bitLength } from "./arithmetic.js";
import { tabulate } from "./columns.js";
import {
  CLASS_BITS,
  CODE_LIMIT,
  LOG_SCALE_PLANES,
  POSITION_LIMIT,
  REST_CLASSES,
  ROTATION_INDEX_BITS,
  SH_DC_PLANES,
} from "./constants.js";
import { decodeFixed, decodeSigned, sequenceModels } from "./integers.js";
import type { SequenceModels } from "./integers.js";
import type { Section } from "./planes.js";
import { demand } from "./reject.js";
import { expandRotation } from "./rotation.js";

/** The models of these attributes; canonical frames and births have separate ones. */
export class AttributeModels {
  readonly shDc = sequenceModels(CLASS_BITS, SH_DC_PLANES);
  readonly opacity = sequenceModels(CLASS_BITS);
  readonly logScales = sequenceModels(CLASS_BITS, LOG_SCALE_PLANES);
  readonly rotationIndex = sequenceModels(ROTATION_INDEX_BITS);
  readonly rotations = sequenceModels(CLASS_BITS, 3);
}

/** `rows` rows of `count` numbers; the outer context of a number is its row. */
export function decodeRowsApart(section: Section, models: SequenceModels, rows: number, count: number): Int32Array[] {
  const outer = tabulate(rows * count, (i) => Math.floor(i / count));
  return splitRows(decodeSigned(section, models, rows * count, outer), rows);
}

/** `rows` rows of `count` numbers, all in outer context 0. */
export function decodeRowsAlike(section: Section, models: SequenceModels, rows: number, count: number): Int32Array[] {
  return splitRows(decodeSigned(section, models, rows * count, 0), rows);
}

/** SH DC of red, green, blue, from green, red - green and blue - green. */
export function decodeShDc(section: Section, models: AttributeModels, count: number): Int32Array[] {
  const [green, redLess, blueLess] = decodeRowsApart(section, models.shDc, SH_DC_PLANES, count);
  return [sum(redLess, green), green, sum(blueLess, green)].map(checkCodes);
}

/** Coded rotations (7.2). */
export interface CodedRotations {
  /** The indices j of the omitted components. */
  readonly indices: Uint8Array;
  /** The rows of the other three, a, b, c. */
  readonly parts: readonly Int32Array[];
}

export function decodeRotations(section: Section, models: AttributeModels, count: number): CodedRotations {
  const indices = decodeFixed(section, models.rotationIndex, count, 0);
  return { indices, parts: decodeRowsApart(section, models.rotations, 3, count) };
}

/** Rotations w, x, y, z, from the index of the omitted component and the other three. */
export function expandRotations({ indices, parts: [a, b, c] }: CodedRotations, rotationBits: number): Int32Array[] {
  const rotations = [0, 1, 2, 3].map(() => new Int32Array(indices.length));
  for (let i = 0; i < indices.length; i++) {
    const rotation = expandRotation(indices[i], [a[i], b[i], c[i]], rotationBits);
    rotations.forEach((column, component) => {
      column[i] = rotation[component];
    });
  }
  return rotations;
}

/** The outer contexts of a row, each from the sum of the magnitudes in the preceding rows. */
export function contextsOfSums(row: number, sums: Int32Array): Int32Array {
  return sums.map((sum) => REST_CLASSES * row + Math.min(bitLength(sum), REST_CLASSES - 1));
}

/** Check that every number of a row is a valid code, and return the row. */
export function checkCodes(row: Int32Array): Int32Array {
  const greatest = row.reduce((most, code) => Math.max(most, Math.abs(code)), 0);
  demand(greatest <= CODE_LIMIT, "code-range", `a code of magnitude ${greatest}`);
  return row;
}

export function sum(first: Int32Array, second: Int32Array): Int32Array {
  return first.map((number, i) => number + second[i]);
}

/** Check a coordinate and return it. */
export function checkPosition(coordinate: number): number {
  demand(Math.abs(coordinate) <= POSITION_LIMIT, "position-range", `a coordinate of ${coordinate}`);
  return coordinate;
}

function splitRows(numbers: Int32Array, rows: number): Int32Array[] {
  const count = numbers.length / rows;
  return Array.from({ length: rows }, (_, row) => numbers.subarray(row * count, (row + 1) * count));
}
