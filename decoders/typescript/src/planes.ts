/** Decodes planes of bits, each bit in a context of the plane's model (SPEC 8.1, 8.2). */

import { Coder } from "./coder.js";
import { CODE_BITS, COUNT_LIMIT, HALF_WEIGHT, PROBABILITY_CODES, STATED_WEIGHT, WEIGHT_TOTAL } from "./constants.js";
import type { Words } from "./fields.js";
import { demand } from "./reject.js";

/** A set of contexts, each with its counts of zeros and ones. */
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
    return computeCountWeight(this.#zeros[context], this.#ones[context]);
  }

  /** Add the counts of a plane to a context. */
  addCounts(context: number, zeros: number, ones: number): void {
    [this.#zeros[context], this.#ones[context]] = halveCounts(this.#zeros[context] + zeros, this.#ones[context] + ones);
  }
}

/** Compute the weight of a 1 from counts. The quotient is below 2^24, so its floor is exact. */
export function computeCountWeight(zeros: number, ones: number): number {
  return Math.floor(((2 * ones + 1) * WEIGHT_TOTAL) / (2 * (zeros + ones) + 2));
}

/** Compute the weight of a 1 from a probability code. */
export function computeCodeWeight(code: number): number {
  demand(code < PROBABILITY_CODES, "bad-probability", `the probability code ${code} is not below ${PROBABILITY_CODES}`);
  const half = PROBABILITY_CODES / 2;
  if (code >= half) return WEIGHT_TOTAL - computeCodeWeight(code - half);
  return (8 + (code % 8)) * 2 ** (Math.floor(code / 8) + 5);
}

/** Halve counts until their sum is at most COUNT_LIMIT. */
export function halveCounts(zeros: number, ones: number): [number, number] {
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

  /** Decode the bits of a plane; element i is in context `contexts[i]`. */
  decodePlane(model: Model, contexts: Int32Array): Uint8Array {
    const { usedContexts, endOffsets, sortedElements } = groupByContext(contexts, model.contextCount);
    const weights = this.#readWeights(model, usedContexts);
    const bits = new Uint8Array(contexts.length);
    let nextElement = 0;
    usedContexts.forEach((context, group) => {
      const start = nextElement;
      let ones = 0;
      for (; nextElement < endOffsets[group]; nextElement++) {
        const bit = this.#coder.decodeBit(weights[group]);
        bits[sortedElements[nextElement]] = bit;
        ones += bit;
      }
      model.addCounts(context, nextElement - start - ones, ones);
    });
    return bits;
  }

  /** Decode the bits of a raw plane, which all have equal probabilities. */
  decodeRawPlane(count: number): Uint8Array {
    const bits = new Uint8Array(count);
    for (let i = 0; i < count; i++) bits[i] = this.#coder.decodeBit(HALF_WEIGHT);
    return bits;
  }

  /** Check that the section ends after its last plane. */
  finish(): void {
    this.#coder.finish();
  }

  /** Read the weights of a plane. Contexts without a stated probability derive their weight from counts. */
  #readWeights(model: Model, usedContexts: readonly number[]): number[] {
    const isStated = usedContexts.map(() => this.#coder.decodeBit(STATED_WEIGHT));
    return usedContexts.map((context, group) =>
      isStated[group] ? computeCodeWeight(this.#coder.decodeBits(CODE_BITS)) : model.weight(context),
    );
  }
}

interface Groups {
  /** The contexts that occur in the plane, ascending. */
  readonly usedContexts: readonly number[];
  /** For each used context, the end of its elements in `sortedElements`. */
  readonly endOffsets: readonly number[];
  /** The indices of the elements, sorted by context and then by index. */
  readonly sortedElements: Uint32Array;
}

function groupByContext(contexts: Int32Array, contextCount: number): Groups {
  const nextElement = new Uint32Array(contextCount);
  for (let i = 0; i < contexts.length; i++) nextElement[contexts[i]] += 1;
  const usedContexts: number[] = [];
  const endOffsets: number[] = [];
  let start = 0;
  nextElement.forEach((count, context) => {
    nextElement[context] = start;
    start += count;
    if (count > 0) {
      usedContexts.push(context);
      endOffsets.push(start);
    }
  });
  const sortedElements = new Uint32Array(contexts.length);
  for (let i = 0; i < contexts.length; i++) sortedElements[nextElement[contexts[i]]++] = i;
  return { usedContexts, endOffsets, sortedElements };
}
