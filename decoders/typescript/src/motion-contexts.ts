/** The contexts of motion (SPEC 8.7): classes of an anchor's expected motion, and of its parent's motion. */

/** The classes of row P, which updates use, too (8.8). */
export const PARENT_CLASSES = 4;

export const MOVES_CONTEXTS = 20;
export const NOT_ZERO_CONTEXTS = 16;
export const SIGN_CONTEXTS = 9;
export const MAGNITUDE_CONTEXTS = 33;

/** 5 P + E, from the sums of magnitudes of the parent's symbols and of the expected symbols. */
export function movesContext(parentSum: number, expectedSum: number): number {
  return 5 * parentClass(parentSum) + doublingClass(expectedSum);
}

/** Row P of the table: 0 for 0, 1 for 1, 2 for 2 to 3, 3 for 4 and above. */
export function parentClass(sum: number): number {
  return Math.min(doublingClass(sum), PARENT_CLASSES - 1);
}

/** 4 min(|e|, 3) + min(n, 3), for the expected symbol e and the number n of preceding nonzero channels. */
export function notZeroContext(expected: number, notZeroBefore: number): number {
  return 4 * Math.min(Math.abs(expected), 3) + Math.min(notZeroBefore, 3);
}

/** 4 + sign(e) k, for the expected symbol e. */
export function signContext(expected: number): number {
  return 4 + Math.sign(expected) * doublingClass(Math.abs(expected));
}

/** 11 min(i, 2) + k, where k is the class of the expected symbol, in the direction of the symbol's sign, minus i. */
export function magnitudeContext(plane: number, expectedWithSign: number): number {
  const greatestOfClass = [-9, -4, -2, -1, 0, 1, 2, 3, 5, 9, Infinity];
  const ahead = expectedWithSign - plane;
  return 11 * Math.min(plane, 2) + greatestOfClass.findIndex((greatest) => ahead <= greatest);
}

/** 0 for 0, 1 for 1, 2 for 2 to 3, 3 for 4 to 7, 4 for 8 and above. */
function doublingClass(magnitude: number): number {
  return Math.min(32 - Math.clz32(magnitude), 4);
}
