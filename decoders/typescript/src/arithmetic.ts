/**
 * Integer arithmetic (SPEC 4). A `number` represents integers up to 2^53 exactly. According to Annex E, this suffices
 * except for the normalization of rotations (7.3), which uses `divideRound` and `isqrt` with `bigint`.
 */

/** Divide, and round to the nearest integer, halves away from 0. The denominator must be above 0. */
export function divideRound(numerator: bigint, denominator: bigint): bigint {
  const magnitude = numerator < 0n ? -numerator : numerator;
  const quotient = (2n * magnitude + denominator) / (2n * denominator);
  return numerator < 0n ? -quotient : quotient;
}

/** Return the largest r with r x r <= value, for 0 <= value <= 2^62. */
export function isqrt(value: bigint): bigint {
  // The floating-point square root is off by at most 1; the two loops correct it.
  let root = BigInt(Math.floor(Math.sqrt(Number(value))));
  while (root * root > value) root -= 1n;
  while ((root + 1n) * (root + 1n) <= value) root += 1n;
  return root;
}

/** Return the smallest b with value < 2^b, for 0 <= value < 2^32. */
export function bitLength(value: number): number {
  return 32 - Math.clz32(value);
}
