/** The contexts of motion (SPEC 8.7), from an anchor's expected motion and its parent's motion. */

/** Number of classes of row P; updates also use these classes (8.8). */
export const PARENT_CLASSES = 4;

export const MOVES_CONTEXTS = 20;
export const NOT_ZERO_CONTEXTS = 16;
export const SIGN_CONTEXTS = 9;
export const MAGNITUDE_CONTEXTS = 33;

/** Return 5 P + E, from the sums of magnitudes of the parent's symbols and of the expected symbols. */
export function movesContext(parentSum: number, expectedSum: number): number {
  return 5 * parentClass(parentSum) + magnitudeClass(expectedSum);
}

/** Return P: 0 for a sum of 0, 1 for 1, 2 for 2 to 3, 3 for 4 and above. */
export function parentClass(sum: number): number {
  return Math.min(magnitudeClass(sum), PARENT_CLASSES - 1);
}

/** Return 4 min(|e|, 3) + min(n, 3), for the expected symbol e and the number n of preceding nonzero channels. */
export function notZeroContext(expected: number, nonzeroCount: number): number {
  return 4 * Math.min(Math.abs(expected), 3) + Math.min(nonzeroCount, 3);
}

/** Return 4 + sign(e) k, for the expected symbol e and the class k of its magnitude. */
export function signContext(expected: number): number {
  return 4 + Math.sign(expected) * magnitudeClass(Math.abs(expected));
}

/** Return 11 min(i, 2) + k for plane i; k is the class of (expected symbol times sign of the symbol) - i. */
export function magnitudeContext(plane: number, expectedWithSign: number): number {
  const classLimits = [-9, -4, -2, -1, 0, 1, 2, 3, 5, 9, Infinity];
  const difference = expectedWithSign - plane;
  return 11 * Math.min(plane, 2) + classLimits.findIndex((limit) => difference <= limit);
}

/** Return the class of a magnitude: 0 for 0, 1 for 1, 2 for 2 to 3, 3 for 4 to 7, 4 for 8 and above. */
function magnitudeClass(magnitude: number): number {
  return Math.min(32 - Math.clz32(magnitude), 4);
}
