/** The random number generator Philox4x32-10 (SPEC 6.2). */

import { PHILOX_DOMAIN_SAMPLER, PHILOX_ROUNDS } from "./constants.js";

export type Counter = readonly [number, number, number, number];
export type Key = readonly [number, number];

/** Generate four random words from a counter of four words and a key of two words. */
export function philox(counter: Counter, key: Key): Counter {
  let [c0, c1, c2, c3] = counter;
  let [k0, k1] = key;
  for (let round = 0; round < PHILOX_ROUNDS; round++) {
    const [pHigh, pLow] = multiply(0xd2511f53, c0);
    const [qHigh, qLow] = multiply(0xcd9e8d57, c2);
    [c0, c1, c2, c3] = [(qHigh ^ c1 ^ k0) >>> 0, qLow, (pHigh ^ c3 ^ k1) >>> 0, pLow];
    k0 = (k0 + 0x9e3779b9) >>> 0;
    k1 = (k1 + 0xbb67ae85) >>> 0;
  }
  return [c0, c1, c2, c3];
}

/** Draw a word for each level and Gaussian; word and id are the rank of the Gaussian. */
export function drawRanks(ids: Uint32Array, phase: number, seed: bigint, levelCount: number): Uint32Array[] {
  const key: Key = [Number(seed & 0xffffffffn), Number(seed >> 32n)];
  const ranks = Array.from({ length: levelCount }, () => new Uint32Array(ids.length));
  ids.forEach((id, i) => {
    const words = philox([id, phase, 0, PHILOX_DOMAIN_SAMPLER], key);
    ranks.forEach((column, level) => {
      column[i] = words[level];
    });
  });
  return ranks;
}

/** Return the upper and lower word of a product of two words. A word times half a word is below 2^48 and exact. */
function multiply(first: number, second: number): [number, number] {
  const lowerProduct = (first & 0xffff) * second;
  const upperProduct = (first >>> 16) * second + Math.floor(lowerProduct / 2 ** 16);
  return [Math.floor(upperProduct / 2 ** 16), ((upperProduct % 2 ** 16) * 2 ** 16 + (lowerProduct % 2 ** 16)) >>> 0];
}
