/**
 * Integer arithmetic (SPEC 4). A `number` is an exact integer up to 2^53, which Annex E shows to be enough
 * for all but normalization (7.3): these functions are for that, and take `bigint`.
 */

/** The integer nearest to numerator / denominator, denominator > 0; of two equally near, the one farther from 0. */
export function divideRound(numerator: bigint, denominator: bigint): bigint {
  const magnitude = numerator < 0n ? -numerator : numerator;
  const quotient = (2n * magnitude + denominator) / (2n * denominator);
  return numerator < 0n ? -quotient : quotient;
}

/** The largest r with r x r <= value, for 0 <= value <= 2^62. */
export function isqrt(value: bigint): bigint {
  // The floating square root is at most 1 away from the root: the two loops make it exact.
  let root = BigInt(Math.floor(Math.sqrt(Number(value))));
  while (root * root > value) root -= 1n;
  while ((root + 1n) * (root + 1n) <= value) root += 1n;
  return root;
}

/** The least b with value < 2^b, for 0 <= value < 2^32. */
export function bitLength(value: number): number {
  return 32 - Math.clz32(value);
}
