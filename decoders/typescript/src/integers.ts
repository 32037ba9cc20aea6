/** Sequences of integers as planes: Fixed, Unsigned, Signed, Ascending (SPEC 8.4). */

import { indicesWhere, pick, tabulate } from "./columns.js";
import { DIFFERENCE_LIMIT, MODELLED_BITS } from "./constants.js";
import { Model } from "./planes.js";
import type { Section } from "./planes.js";
import { demand } from "./reject.js";
import type { RejectId } from "./reject.js";

/** The three models of a sequence, and the number K of bits of its classes. */
export interface SequenceModels {
  readonly classBits: number;
  readonly class: Model;
  readonly sign: Model;
  readonly mantissa: Model;
}

/** The outer contexts of a sequence: one per number, or one for all. */
export type OuterContexts = Int32Array | number;

/** The models of a sequence with outer contexts below `outerCount`. */
export function sequenceModels(classBits: number, outerCount = 1): SequenceModels {
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
  const numbers = 2 ** models.classBits;
  const nodes = new Uint8Array(count).fill(1);
  const contexts = new Int32Array(count);
  for (let bit = 0; bit < models.classBits; bit++) {
    for (let i = 0; i < count; i++) contexts[i] = outerAt(outer, i) * numbers + nodes[i];
    const bits = section.plane(models.class, contexts);
    for (let i = 0; i < count; i++) nodes[i] = 2 * nodes[i] + bits[i];
  }
  return nodes.map((node) => node - numbers);
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

/** Read `count` numbers that do not descend; those not below `limit` are rejected with `rejectId`. */
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

/** Numbers of up to 63 bits, as two halves. */
interface Magnitudes {
  readonly high: Uint32Array;
  readonly low: Uint32Array;
}

/** Numbers of the given classes: a leading 1, and the bits below it, most significant first. */
function decodeMantissas(section: Section, models: SequenceModels, classes: Uint8Array, base: Int32Array): Magnitudes {
  const magnitudes = { high: new Uint32Array(classes.length), low: new Uint32Array(classes.length) };
  classes.forEach((size, i) => {
    if (size > 0) setBit(magnitudes, i, size - 1);
  });
  const known = new Uint8Array(classes.length).fill(1);
  for (let d = 0; ; d++) {
    const asked = indicesWhere(classes.length, (i) => classes[i] > d + 1);
    if (asked.length === 0) return magnitudes;
    const modelled = d < MODELLED_BITS;
    const bits = modelled
      ? section.plane(
          models.mantissa,
          pick(base, asked).map((b, place) => b * 2 ** MODELLED_BITS + known[asked[place]]),
        )
      : section.raw(asked.length);
    asked.forEach((i, place) => {
      if (modelled) known[i] = 2 * known[i] + bits[place];
      if (bits[place]) setBit(magnitudes, i, classes[i] - 2 - d);
    });
  }
}

/** Of every nonzero number, 1 if it is negative. */
function decodeSigns(section: Section, models: SequenceModels, classes: Uint8Array, base: Int32Array): Uint8Array {
  const asked = indicesWhere(classes.length, (i) => classes[i] > 0);
  const bits = section.plane(models.sign, pick(base, asked));
  const signs = new Uint8Array(classes.length);
  asked.forEach((i, place) => {
    signs[i] = bits[place];
  });
  return signs;
}

/** c x 2^K + k for every number. */
function classContexts(models: SequenceModels, classes: Uint8Array, outer: OuterContexts): Int32Array {
  return tabulate(classes.length, (i) => outerAt(outer, i) * 2 ** models.classBits + classes[i]);
}

function outerAt(outer: OuterContexts, index: number): number {
  return typeof outer === "number" ? outer : outer[index];
}

function setBit({ high, low }: Magnitudes, index: number, bit: number): void {
  if (bit < 32) low[index] |= 1 << bit;
  else high[index] |= 1 << (bit - 32);
}
