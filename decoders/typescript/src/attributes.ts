/** Decodes attributes that are coded in the same way in canonical frames and in births (SPEC 7.2, 8.5, 8.6). */

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
import { decodeFixed, decodeSigned, makeSequenceModels } from "./integers.js";
import type { SequenceModels } from "./integers.js";
import type { Section } from "./planes.js";
import { demand } from "./reject.js";
import { expandRotation } from "./rotation.js";

/** The models of the common attributes; canonical frames and births have separate models. */
export class AttributeModels {
  readonly shDc = makeSequenceModels(CLASS_BITS, SH_DC_PLANES);
  readonly opacity = makeSequenceModels(CLASS_BITS);
  readonly logScales = makeSequenceModels(CLASS_BITS, LOG_SCALE_PLANES);
  readonly rotationIndex = makeSequenceModels(ROTATION_INDEX_BITS);
  readonly rotations = makeSequenceModels(CLASS_BITS, 3);
}

/** Decode `rows` rows of `count` numbers; the outer context of a number is its row. */
export function decodeRowsByContext(
  section: Section,
  models: SequenceModels,
  rows: number,
  count: number,
): Int32Array[] {
  const outerContexts = tabulate(rows * count, (i) => Math.floor(i / count));
  return splitRows(decodeSigned(section, models, rows * count, outerContexts), rows);
}

/** Decode `rows` rows of `count` numbers, all in outer context 0. */
export function decodeRowsInOneContext(
  section: Section,
  models: SequenceModels,
  rows: number,
  count: number,
): Int32Array[] {
  return splitRows(decodeSigned(section, models, rows * count, 0), rows);
}

/** Decode green, red - green and blue - green; return the SH DC codes of red, green and blue. */
export function decodeShDc(section: Section, models: AttributeModels, count: number): Int32Array[] {
  const [green, redDifference, blueDifference] = decodeRowsByContext(section, models.shDc, SH_DC_PLANES, count);
  return [addColumns(redDifference, green), green, addColumns(blueDifference, green)].map(checkCodes);
}

/** Rotations as they are coded (7.2). */
export interface CodedRotations {
  /** The indices j of the omitted components. */
  readonly indices: Uint8Array;
  /** The rows of the other three components, a, b and c. */
  readonly components: readonly Int32Array[];
}

export function decodeRotations(section: Section, models: AttributeModels, count: number): CodedRotations {
  const indices = decodeFixed(section, models.rotationIndex, count, 0);
  return { indices, components: decodeRowsByContext(section, models.rotations, 3, count) };
}

/** Return the rows w, x, y, z of coded rotations. */
export function expandRotations(
  { indices, components: [a, b, c] }: CodedRotations,
  rotationBits: number,
): Int32Array[] {
  const rotations = [0, 1, 2, 3].map(() => new Int32Array(indices.length));
  for (let i = 0; i < indices.length; i++) {
    const rotation = expandRotation(indices[i], [a[i], b[i], c[i]], rotationBits);
    rotations.forEach((column, component) => {
      column[i] = rotation[component];
    });
  }
  return rotations;
}

/** Return the outer contexts of a row, from the sums of magnitudes in the preceding rows. */
export function sumContexts(row: number, sums: Int32Array): Int32Array {
  return sums.map((addColumns) => REST_CLASSES * row + Math.min(bitLength(addColumns), REST_CLASSES - 1));
}

/** Check that every number of a row is in the range of codes, and return the row. */
export function checkCodes(row: Int32Array): Int32Array {
  const maxMagnitude = row.reduce((max, code) => Math.max(max, Math.abs(code)), 0);
  demand(maxMagnitude <= CODE_LIMIT, "code-range", `a code of magnitude ${maxMagnitude}`);
  return row;
}

export function addColumns(first: Int32Array, second: Int32Array): Int32Array {
  return first.map((number, i) => number + second[i]);
}

/** Check that a coordinate is in the range of positions, and return it. */
export function checkPosition(coordinate: number): number {
  demand(Math.abs(coordinate) <= POSITION_LIMIT, "position-range", `a coordinate of ${coordinate}`);
  return coordinate;
}

function splitRows(numbers: Int32Array, rows: number): Int32Array[] {
  const count = numbers.length / rows;
  return Array.from({ length: rows }, (_, row) => numbers.subarray(row * count, (row + 1) * count));
}
