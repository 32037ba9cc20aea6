/** Planes of bits, each bit in a context of the plane's model (SPEC 8.1, 8.2). */

import { Coder } from "./coder.js";
import { CODE_BITS, COUNT_LIMIT, HALF_WEIGHT, PROBABILITY_CODES, STATED_WEIGHT, WEIGHT_TOTAL } from "./constants.js";
import type { Words } from "./fields.js";
import { demand } from "./reject.js";

/** Contexts of planes with the same model, each with its counts of zeros and ones. */
export class Model {
  readonly contextCount: number;
  readonly #zeros: Uint16Array;
  readonly #ones: Uint16Array;

  constructor(contextCount: number) {
    this.contextCount = contextCount;
    this.#zeros = new Uint16Array(contextCount);
    this.#ones = new Uint16Array(contextCount);
  }

  weight(context: number): number {
    return weightOfCounts(this.#zeros[context], this.#ones[context]);
  }

  /** Add the counts of a plane to a context. */
  add(context: number, zeros: number, ones: number): void {
    [this.#zeros[context], this.#ones[context]] = halved(this.#zeros[context] + zeros, this.#ones[context] + ones);
  }
}

/** The weight of a 1 derived from counts. The quotient is below 2^24, so its floor is exact. */
export function weightOfCounts(zeros: number, ones: number): number {
  return Math.floor(((2 * ones + 1) * WEIGHT_TOTAL) / (2 * (zeros + ones) + 2));
}

/** The weight of a 1 of a probability code. */
export function weightOfCode(code: number): number {
  demand(code < PROBABILITY_CODES, "bad-probability", `a probability code of ${code}`);
  const half = PROBABILITY_CODES / 2;
  if (code >= half) return WEIGHT_TOTAL - weightOfCode(code - half);
  return (8 + (code % 8)) * 2 ** (Math.floor(code / 8) + 5);
}

/** Counts after a plane. */
export function halved(zeros: number, ones: number): [number, number] {
  while (zeros + ones > COUNT_LIMIT) {
    zeros = Math.floor(zeros / 2);
    ones = Math.floor(ones / 2);
  }
  return [zeros, ones];
}

/** Reads a section plane by plane. */
export class Section {
  readonly #coder: Coder;

  constructor(words: Words) {
    this.#coder = new Coder(words);
  }

  /** The bits of a plane; element i is in context `contexts[i]`. */
  plane(model: Model, contexts: Int32Array): Uint8Array {
    const { used, ends, elements } = groupByContext(contexts, model.contextCount);
    const weights = this.#readWeights(model, used);
    const bits = new Uint8Array(contexts.length);
    let next = 0;
    used.forEach((context, place) => {
      const start = next;
      let ones = 0;
      for (; next < ends[place]; next++) {
        const bit = this.#coder.bit(weights[place]);
        bits[elements[next]] = bit;
        ones += bit;
      }
      model.add(context, next - start - ones, ones);
    });
    return bits;
  }

  /** The bits of a raw plane. */
  raw(count: number): Uint8Array {
    const bits = new Uint8Array(count);
    for (let i = 0; i < count; i++) bits[i] = this.#coder.bit(HALF_WEIGHT);
    return bits;
  }

  /** End the section after its last plane. */
  finish(): void {
    this.#coder.finish();
  }

  /** The weights of a plane: derived from the counts, except in contexts whose probability is stated. */
  #readWeights(model: Model, used: readonly number[]): number[] {
    const stated = used.map(() => this.#coder.bit(STATED_WEIGHT));
    return used.map((context, place) =>
      stated[place] ? weightOfCode(this.#coder.bits(CODE_BITS)) : model.weight(context),
    );
  }
}

interface Groups {
  /** The contexts that occur, ascending. */
  readonly used: readonly number[];
  /** The end of each context's elements in `elements`. */
  readonly ends: readonly number[];
  /** The elements, context by context, otherwise in order. */
  readonly elements: Uint32Array;
}

function groupByContext(contexts: Int32Array, contextCount: number): Groups {
  const next = new Uint32Array(contextCount);
  for (let i = 0; i < contexts.length; i++) next[contexts[i]] += 1;
  const used: number[] = [];
  const ends: number[] = [];
  let start = 0;
  next.forEach((count, context) => {
    next[context] = start;
    start += count;
    if (count > 0) {
      used.push(context);
      ends.push(start);
    }
  });
  const elements = new Uint32Array(contexts.length);
  for (let i = 0; i < contexts.length; i++) elements[next[contexts[i]]++] = i;
  return { used, ends, elements };
}
