/** The coder, whose state has two halves of 32 bits, matches SPEC 8.3 computed with `bigint`. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { Coder } from "../src/coder.js";
import { philox } from "../src/philox.js";
import { Rejection } from "../src/reject.js";

const WEIGHT_TOTAL = 1n << 24n;

/** Decode words as SPEC 8.3 defines it; return the bits and the last state. */
function decodeByDefinition(storedWords: readonly number[], weights: readonly number[]): [number[], bigint] {
  const words = storedWords.map(BigInt);
  let state = words.pop() ?? 0n;
  const bits = weights.map((weight) => {
    if (state < 1n << 32n && words.length > 0) state = (state << 32n) + (words.pop() ?? 0n);
    const remainder = state % WEIGHT_TOTAL;
    const w = BigInt(weight);
    const bit = remainder >= WEIGHT_TOTAL - w;
    const [offset, share] = bit ? [WEIGHT_TOTAL - w, w] : [0n, WEIGHT_TOTAL - w];
    state = (state / WEIGHT_TOTAL) * share + remainder - offset;
    return bit ? 1 : 0;
  });
  return [bits, state];
}

function makeCoder(storedWords: readonly number[]): Coder {
  return new Coder({ length: storedWords.length, wordAt: (i) => storedWords[i] });
}

function checkDecoding(storedWords: readonly number[], weights: readonly number[]): void {
  const coder = makeCoder(storedWords);

  assert.deepEqual(
    weights.map((weight) => coder.decodeBit(weight)),
    decodeByDefinition(storedWords, weights)[0],
  );
}

const EXTREME_WEIGHTS = [256, 2047, 2048, 262144, 8388607, 8388608, 8388609, 16775168, 16776960];

test("random words at random weights decode as in 8.3", () => {
  for (let trial = 0; trial < 200; trial++) {
    const storedWords = [0, 1, 2, 3, 4].flatMap((i) => [...philox([trial, i, 0, 0], [0, 0])]);
    const weights = storedWords.flatMap((word, i) => [
      EXTREME_WEIGHTS[word % EXTREME_WEIGHTS.length],
      256 + ((word >>> i) % 16776704),
    ]);

    checkDecoding(storedWords, [...weights, ...weights]);
  }
});

test("repeated words decode as in 8.3", () => {
  for (const word of [0xffffffff, 0xff000000, 0x00ffffff, 0x80000000, 1]) {
    for (const weight of EXTREME_WEIGHTS)
      checkDecoding(new Array<number>(6).fill(word), new Array<number>(200).fill(weight));
  }
});

test("a last word of 0, a remaining state and remaining words are rejected", () => {
  assert.throws(() => makeCoder([5, 0]), new Rejection("invalid-words", "the last word of a section is 0"));
  assert.throws(() => makeCoder([1]).finish(), { rejectId: "unconsumed-words" });
  assert.throws(
    () => {
      const coder = makeCoder([7, 0x00800000]);
      coder.decodeBit(8388608);
      coder.finish();
    },
    { rejectId: "unconsumed-words" },
  );
});
