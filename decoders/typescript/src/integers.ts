/** Decodes sequences of integers from planes: Fixed, Unsigned, Signed and Ascending (SPEC 8.4). */

import { indicesWhere, pickColumn, tabulate } from "./columns.js";
import { DIFFERENCE_LIMIT, MODELLED_BITS } from "./constants.js";
import { Model } from "./planes.js";
import type { Section } from "./planes.js";
import { demand } from "./reject.js";
import type { RejectId } from "./reject.js";

/** The three models of a sequence, and the number K of bits of a class. */
export interface SequenceModels {
  readonly classBits: number;
  readonly class: Model;
  readonly sign: Model;
  readonly mantissa: Model;
}

/** The outer contexts of a sequence: one per number, or one for all numbers. */
export type OuterContexts = Int32Array | number;

/** Make the models of a sequence whose outer contexts are below `outerCount`. */
export function makeSequenceModels(classBits: number, outerCount = 1): SequenceModels {
  const classes = outerCount * 2 ** classBits;
  return {
    classBits,
    class: new Model(classes),
    sign: new Model(classes),
    mantissa: new Model(2 * classes * 2 ** MODELLED_BITS),
  };
}

/** Read `count` numbers from 0 to 2^K - 1. */
export function decodeFixed(section: Section, models: SequenceModels, count: number, outer: OuterContexts): Uint8Array {
  const classCount = 2 ** models.classBits;
  const nodes = new Uint8Array(count).fill(1);
  const contexts = new Int32Array(count);
  for (let bit = 0; bit < models.classBits; bit++) {
    for (let i = 0; i < count; i++) contexts[i] = getOuterContext(outer, i) * classCount + nodes[i];
    const bits = section.decodePlane(models.class, contexts);
    for (let i = 0; i < count; i++) nodes[i] = 2 * nodes[i] + bits[i];
  }
  return nodes.map((node) => node - classCount);
}

/** Read `count` numbers with magnitudes below 2^(2^K - 1), where K is at most 5, so that magnitudes have 31 bits. */
export function decodeSigned(
  section: Section,
  models: SequenceModels,
  count: number,
  outer: OuterContexts,
): Int32Array {
  const classes = decodeFixed(section, models, count, outer);
  const contexts = classContexts(models, classes, outer);
  const signs = decodeSigns(section, models, classes, contexts);
  const magnitudes = decodeMantissas(
    section,
    models,
    classes,
    contexts.map((context, i) => 2 * context + signs[i]),
  );
  return tabulate(count, (i) => (signs[i] ? -magnitudes.low[i] : magnitudes.low[i]));
}

/** Read `count` numbers from 0 to 2^(2^K - 1) - 1, where K is at most 6. */
export function decodeUnsigned(
  section: Section,
  models: SequenceModels,
  count: number,
  outer: OuterContexts,
): BigUint64Array {
  const classes = decodeFixed(section, models, count, outer);
  const { high, low } = decodeMantissas(section, models, classes, classContexts(models, classes, outer));
  return new BigUint64Array(count).map((_, i) => (BigInt(high[i]) << 32n) + BigInt(low[i]));
}

/** Read `count` numbers in ascending order; numbers that are not below `limit` are rejected with `rejectId`. */
export function decodeAscending(
  section: Section,
  models: SequenceModels,
  count: number,
  limit: bigint,
  rejectId: RejectId,
): BigUint64Array {
  let sum = 0n;
  return decodeUnsigned(section, models, count, 0).map((difference) => {
    demand(difference <= DIFFERENCE_LIMIT, "symbol-range", "an ascending number grows by more than 2^60");
    sum += difference;
    demand(sum < limit, rejectId, `${sum} is not below ${limit}`);
    return sum;
  });
}

/** Magnitudes of up to 63 bits, as upper and lower 32 bits. */
interface Magnitudes {
  readonly high: Uint32Array;
  readonly low: Uint32Array;
}

/** Decode the magnitudes of classes: a leading 1, then the lower bits, most significant bit first. */
function decodeMantissas(
  section: Section,
  models: SequenceModels,
  classes: Uint8Array,
  baseContexts: Int32Array,
): Magnitudes {
  const magnitudes = { high: new Uint32Array(classes.length), low: new Uint32Array(classes.length) };
  classes.forEach((classNumber, i) => {
    if (classNumber > 0) setBit(magnitudes, i, classNumber - 1);
  });
  const prefixes = new Uint8Array(classes.length).fill(1);
  for (let depth = 0; ; depth++) {
    const codedIndices = indicesWhere(classes.length, (i) => classes[i] > depth + 1);
    if (codedIndices.length === 0) return magnitudes;
    const isModelled = depth < MODELLED_BITS;
    const bits = isModelled
      ? section.decodePlane(
          models.mantissa,
          pickColumn(baseContexts, codedIndices).map((b, row) => b * 2 ** MODELLED_BITS + prefixes[codedIndices[row]]),
        )
      : section.decodeRawPlane(codedIndices.length);
    codedIndices.forEach((i, row) => {
      if (isModelled) prefixes[i] = 2 * prefixes[i] + bits[row];
      if (bits[row]) setBit(magnitudes, i, classes[i] - 2 - depth);
    });
  }
}

/** Decode the sign of every nonzero number: 1 if it is negative. */
function decodeSigns(
  section: Section,
  models: SequenceModels,
  classes: Uint8Array,
  baseContexts: Int32Array,
): Uint8Array {
  const codedIndices = indicesWhere(classes.length, (i) => classes[i] > 0);
  const bits = section.decodePlane(models.sign, pickColumn(baseContexts, codedIndices));
  const signs = new Uint8Array(classes.length);
  codedIndices.forEach((i, row) => {
    signs[i] = bits[row];
  });
  return signs;
}

/** Return the context c x 2^K + k of every number, for outer context c and class k. */
function classContexts(models: SequenceModels, classes: Uint8Array, outer: OuterContexts): Int32Array {
  return tabulate(classes.length, (i) => getOuterContext(outer, i) * 2 ** models.classBits + classes[i]);
}

function getOuterContext(outer: OuterContexts, index: number): number {
  return typeof outer === "number" ? outer : outer[index];
}

function setBit({ high, low }: Magnitudes, index: number, bit: number): void {
  if (bit < 32) low[index] |= 1 << bit;
  else high[index] |= 1 << (bit - 32);
}
