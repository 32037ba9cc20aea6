/** Samples anchors (SPEC 6.1 to 6.3). */

import { bitLength } from "./arithmetic.js";
import { allIndices, indicesWhere, tabulate } from "./columns.js";
import { LATTICE_BITS, LATTICE_OFFSET } from "./constants.js";
import type { StreamHeader } from "./header.js";
import { compareMorton } from "./morton.js";
import { drawRanks } from "./philox.js";
import type { Scene } from "./scene.js";

/** The fields of HEAD that determine the number of anchors. */
type CountFields = Pick<StreamHeader, "gaussiansPerAnchor" | "anchorRatio" | "levelCount">;

/** Return the numbers of anchors A_1 ... A_L for `count` Gaussians. */
export function computeAnchorCounts(count: number, header: CountFields): number[] {
  const counts = [Math.ceil(count / header.gaussiansPerAnchor)];
  while (counts.length < header.levelCount) {
    counts.push(Math.max(1, Math.floor(counts[counts.length - 1] / header.anchorRatio)));
  }
  return counts;
}

/** Sample the anchors of each level, beginning with level 1; return the indices of their Gaussians, ascending. */
export function sampleAnchors(
  scene: Pick<Scene, "ids" | "positions">,
  phase: number,
  header: CountFields & Pick<StreamHeader, "seed">,
): Uint32Array[] {
  const ranks = drawRanks(scene.ids, phase, header.seed, header.levelCount);
  const order = sortByCells(scene.positions);
  return computeAnchorCounts(scene.ids.length, header).map((count, level) => sampleLevel(order, ranks[level], count));
}

/** The Gaussians in an order in which Gaussians of the same cell are adjacent at every shift. */
interface CellOrder {
  readonly indices: Uint32Array;
  /** For each entry except the first, the lowest shift at which it shares a cell with the previous entry. */
  readonly commonShifts: Int32Array;
  /** For every shift, the number of occupied cells. */
  readonly cellCounts: readonly number[];
}

function sortByCells(positions: readonly Int32Array[]): CellOrder {
  const biased = positions.map((column) => column.map((coordinate) => coordinate + LATTICE_OFFSET));
  const indices = allIndices(biased[0].length).sort((i, j) => compareMorton(biased, i, j));
  const commonShifts = tabulate(indices.length, (position) =>
    position === 0 ? LATTICE_BITS + 1 : findCommonShift(biased, indices[position - 1], indices[position]),
  );
  const cellCounts = Array.from({ length: LATTICE_BITS + 1 }, (_, shift) =>
    commonShifts.reduce((cells, commonShift) => cells + (commonShift > shift ? 1 : 0), 0),
  );
  return { indices, commonShifts, cellCounts };
}

/** Return the lowest shift at which two Gaussians share a cell. */
function findCommonShift(columns: readonly Int32Array[], first: number, second: number): number {
  return bitLength(columns.reduce((differingBits, column) => differingBits | (column[first] ^ column[second]), 0));
}

function sampleLevel(order: CellOrder, words: Uint32Array, count: number): Uint32Array {
  const shift = order.cellCounts.findIndex((cells) => cells <= count);
  const compareRanks = (i: number, j: number) => words[i] - words[j] || i - j;
  const isAnchor = new Uint8Array(words.length);
  for (const index of selectLowestRanks(order, shift, compareRanks)) isAnchor[index] = 1;
  const missingCount = count - order.cellCounts[shift];
  const otherIndices = indicesWhere(words.length, (i) => isAnchor[i] === 0);
  for (const index of otherIndices.sort(compareRanks).subarray(0, missingCount)) isAnchor[index] = 1;
  return indicesWhere(words.length, (i) => isAnchor[i] === 1);
}

/** Select the Gaussian with the lowest rank in every occupied cell at `shift`. */
function selectLowestRanks(order: CellOrder, shift: number, compareRanks: (i: number, j: number) => number): number[] {
  const lowestRanked: number[] = [];
  order.indices.forEach((index, position) => {
    if (order.commonShifts[position] > shift) lowestRanked.push(index);
    else if (compareRanks(index, lowestRanked[lowestRanked.length - 1]) < 0)
      lowestRanked[lowestRanked.length - 1] = index;
  });
  return lowestRanked;
}
