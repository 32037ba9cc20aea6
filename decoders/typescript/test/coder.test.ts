/** The coder with two halves of 32 bits, against SPEC 8.3 in integers of any size. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { Coder } from "../src/coder.js";
import { philox } from "../src/philox.js";
import { Rejection } from "../src/reject.js";

const TOTAL = 1n << 24n;

/** The bits of the words `stored`, and the last state: 8.3, line by line. */
function twin(stored: readonly number[], weights: readonly number[]): [number[], bigint] {
  const words = stored.map(BigInt);
  let state = words.pop() ?? 0n;
  const bits = weights.map((weight) => {
    if (state < 1n << 32n && words.length > 0) state = (state << 32n) + (words.pop() ?? 0n);
    const part = state % TOTAL;
    const w = BigInt(weight);
    const bit = part >= TOTAL - w;
    const [left, share] = bit ? [TOTAL - w, w] : [0n, TOTAL - w];
    state = (state / TOTAL) * share + part - left;
    return bit ? 1 : 0;
  });
  return [bits, state];
}

function coderOf(stored: readonly number[]): Coder {
  return new Coder({ length: stored.length, at: (i) => stored[i] });
}

function reads(stored: readonly number[], weights: readonly number[]): void {
  const coder = coderOf(stored);

  assert.deepEqual(
    weights.map((weight) => coder.bit(weight)),
    twin(stored, weights)[0],
  );
}

const EXTREMES = [256, 2047, 2048, 262144, 8388607, 8388608, 8388609, 16775168, 16776960];

test("random words at random weights decode as in 8.3", () => {
  for (let run = 0; run < 200; run++) {
    const stored = [0, 1, 2, 3, 4].flatMap((i) => [...philox([run, i, 0, 0], [0, 0])]);
    const weights = stored.flatMap((word, i) => [EXTREMES[word % EXTREMES.length], 256 + ((word >>> i) % 16776704)]);

    reads(stored, [...weights, ...weights]);
  }
});

test("words of all ones decode as in 8.3", () => {
  for (const word of [0xffffffff, 0xff000000, 0x00ffffff, 0x80000000, 1]) {
    for (const weight of EXTREMES) reads(new Array<number>(6).fill(word), new Array<number>(200).fill(weight));
  }
});

test("a last word of 0, a remaining state and remaining words are rejected", () => {
  assert.throws(() => coderOf([5, 0]), new Rejection("invalid-words", "the last word of a section is 0"));
  assert.throws(() => coderOf([1]).finish(), { rejectId: "unconsumed-words" });
  assert.throws(
    () => {
      const coder = coderOf([7, 0x00800000]);
      coder.bit(8388608);
      coder.finish();
    },
    { rejectId: "unconsumed-words" },
  );
});
