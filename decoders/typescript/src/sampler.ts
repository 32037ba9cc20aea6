/** Sampling of anchors (SPEC 6.1 to 6.3). */

import { bitLength } from "./arithmetic.js";
import { allIndices, indicesWhere, tabulate } from "./columns.js";
import { LATTICE_BITS, LATTICE_OFFSET } from "./constants.js";
import type { StreamHeader } from "./header.js";
import { compareMorton } from "./morton.js";
import { drawRanks } from "./philox.js";
import type { Scene } from "./scene.js";

/** The fields of HEAD that determine the number of anchors. */
type CountFields = Pick<StreamHeader, "gaussiansPerAnchor" | "anchorRatio" | "levelCount">;

/** A_1 ... A_L for `count` Gaussians. */
export function anchorCounts(count: number, header: CountFields): number[] {
  const counts = [Math.ceil(count / header.gaussiansPerAnchor)];
  while (counts.length < header.levelCount) {
    counts.push(Math.max(1, Math.floor(counts[counts.length - 1] / header.anchorRatio)));
  }
  return counts;
}

/** For every level, from 1 on, the indices of the Gaussians that are its anchors, ascending. */
export function sampleAnchors(
  scene: Pick<Scene, "ids" | "positions">,
  phase: number,
  header: CountFields & Pick<StreamHeader, "seed">,
): Uint32Array[] {
  const ranks = drawRanks(scene.ids, phase, header.seed, header.levelCount);
  const order = sortByCells(scene.positions);
  return anchorCounts(scene.ids.length, header).map((count, level) => sampleLevel(order, ranks[level], count));
}

/** The Gaussians, sorted so that those of a cell are adjacent at every shift. */
interface CellOrder {
  readonly indices: Uint32Array;
  /** For each entry except the first, the lowest shift at which it shares a cell with the previous entry. */
  readonly joined: Int32Array;
  /** For every shift, the number of occupied cells. */
  readonly cellCounts: readonly number[];
}

function sortByCells(positions: readonly Int32Array[]): CellOrder {
  const biased = positions.map((column) => column.map((coordinate) => coordinate + LATTICE_OFFSET));
  const indices = allIndices(biased[0].length).sort((i, j) => compareMorton(biased, i, j));
  const joined = tabulate(indices.length, (place) =>
    place === 0 ? LATTICE_BITS + 1 : firstCommonShift(biased, indices[place - 1], indices[place]),
  );
  const cellCounts = Array.from({ length: LATTICE_BITS + 1 }, (_, shift) =>
    joined.reduce((cells, first) => cells + (first > shift ? 1 : 0), 0),
  );
  return { indices, joined, cellCounts };
}

/** The lowest shift at which two Gaussians share a cell. */
function firstCommonShift(columns: readonly Int32Array[], first: number, second: number): number {
  return bitLength(columns.reduce((differing, column) => differing | (column[first] ^ column[second]), 0));
}

function sampleLevel(order: CellOrder, words: Uint32Array, count: number): Uint32Array {
  const shift = order.cellCounts.findIndex((cells) => cells <= count);
  const byRank = (i: number, j: number) => words[i] - words[j] || i - j;
  const isAnchor = new Uint8Array(words.length);
  for (const index of leastOfCells(order, shift, byRank)) isAnchor[index] = 1;
  const missing = count - order.cellCounts[shift];
  const others = indicesWhere(words.length, (i) => isAnchor[i] === 0);
  for (const index of others.sort(byRank).subarray(0, missing)) isAnchor[index] = 1;
  return indicesWhere(words.length, (i) => isAnchor[i] === 1);
}

/** For every cell occupied at `shift`, the Gaussian with the lowest rank. */
function leastOfCells(order: CellOrder, shift: number, byRank: (i: number, j: number) => number): number[] {
  const least: number[] = [];
  order.indices.forEach((index, place) => {
    if (order.joined[place] > shift) least.push(index);
    else if (byRank(index, least[least.length - 1]) < 0) least[least.length - 1] = index;
  });
  return least;
}
