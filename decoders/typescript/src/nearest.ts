/**
 * Exact search for the nearest anchor (SPEC 6.4), in a tree of bounding boxes.
 *
 * Coordinates differ by less than 2^24, so squared distances are below 2^50 and exact. The result is the anchor with the
 * lowest (squared distance, index). So a box is skipped if it is farther away than the best anchor so far, or if it is
 * at the same distance and contains no lower index. The boxes form a binary heap: the root is 1, and the halves of box k
 * are 2k and 2k + 1. Every box contains a range of `#anchorIndices`.
 */

import { bitLength } from "./arithmetic.js";
import { allIndices } from "./columns.js";

export type Point = readonly [number, number, number];

/** Maximum number of anchors in a leaf. */
const LEAF_ANCHORS = 8;

/** A squared distance, and the index of an anchor at that distance. */
interface Candidate {
  distance: number;
  anchorIndex: number;
}

/** Half of a box, with its distance, and the lowest index of its anchors. */
interface BoxCandidate extends Candidate {
  readonly box: number;
  readonly start: number;
  readonly end: number;
}

export class AnchorSearch {
  readonly #positions: readonly Int32Array[];
  /** Indices of the anchors, grouped by box. */
  readonly #anchorIndices: Uint32Array;
  /** By axis and box, the minimum and maximum coordinate of the anchors. */
  readonly #minimums: readonly Int32Array[];
  readonly #maximums: readonly Int32Array[];
  /** By box, the lowest index of its anchors. */
  readonly #lowestIndices: Uint32Array;

  /** @param positions x, y, z of the anchors, at least one */
  constructor(positions: readonly Int32Array[]) {
    const count = positions[0].length;
    const boxes = 2 ** (bitLength(Math.ceil(count / LEAF_ANCHORS)) + 1);
    this.#positions = positions;
    this.#anchorIndices = allIndices(count);
    this.#minimums = positions.map(() => new Int32Array(boxes));
    this.#maximums = positions.map(() => new Int32Array(boxes));
    this.#lowestIndices = new Uint32Array(boxes);
    this.#build(1, 0, count);
  }

  /** Return the index of the nearest anchor to `point`. */
  findNearest(point: Point): number {
    const best = { distance: Infinity, anchorIndex: Infinity };
    this.#search(1, 0, this.#anchorIndices.length, point, best);
    return best.anchorIndex;
  }

  #build(box: number, start: number, end: number): void {
    const boxAnchors = this.#anchorIndices.subarray(start, end);
    this.#lowestIndices[box] = boxAnchors.reduce((minimum, n) => Math.min(minimum, n), Infinity);
    this.#positions.forEach((column, axis) => {
      this.#minimums[axis][box] = boxAnchors.reduce((minimum, n) => Math.min(minimum, column[n]), Infinity);
      this.#maximums[axis][box] = boxAnchors.reduce((maximum, n) => Math.max(maximum, column[n]), -Infinity);
    });
    if (boxAnchors.length <= LEAF_ANCHORS) return;
    const column = this.#positions[this.#widestAxis(box)];
    // Equal coordinates are sorted by index, so that the first half has the lowest index of anchors at one position.
    boxAnchors.sort((m, n) => column[m] - column[n] || m - n);
    const middle = (start + end) >>> 1;
    this.#build(2 * box, start, middle);
    this.#build(2 * box + 1, middle, end);
  }

  /** Search a box for an anchor that precedes `best`, and update `best`. */
  #search(box: number, start: number, end: number, point: Point, best: Candidate): void {
    if (end - start <= LEAF_ANCHORS) {
      for (let index = start; index < end; index++) this.#testAnchor(this.#anchorIndices[index], point, best);
      return;
    }
    const middle = (start + end) >>> 1;
    const halves: [BoxCandidate, BoxCandidate] = [
      this.#makeCandidate(2 * box, start, middle, point),
      this.#makeCandidate(2 * box + 1, middle, end, point),
    ];
    if (precedes(halves[1], halves[0])) halves.reverse();
    for (const half of halves) {
      if (precedes(half, best)) this.#search(half.box, half.start, half.end, point, best);
    }
  }

  #makeCandidate(box: number, start: number, end: number, point: Point): BoxCandidate {
    return { box, start, end, distance: this.#distanceToBox(box, point), anchorIndex: this.#lowestIndices[box] };
  }

  #testAnchor(anchorIndex: number, point: Point, best: Candidate): void {
    let distance = 0;
    for (let axis = 0; axis < 3; axis++) distance += (point[axis] - this.#positions[axis][anchorIndex]) ** 2;
    if (!precedes({ distance, anchorIndex }, best)) return;
    best.distance = distance;
    best.anchorIndex = anchorIndex;
  }

  /** Return the squared distance from `point` to a box; 0 if the point is inside. */
  #distanceToBox(box: number, point: Point): number {
    let sum = 0;
    for (let axis = 0; axis < 3; axis++) {
      sum += Math.max(this.#minimums[axis][box] - point[axis], 0, point[axis] - this.#maximums[axis][box]) ** 2;
    }
    return sum;
  }

  #widestAxis(box: number): number {
    const widths = [0, 1, 2].map((axis) => this.#maximums[axis][box] - this.#minimums[axis][box]);
    return widths.indexOf(Math.max(...widths));
  }
}

function precedes(first: Candidate, second: Candidate): boolean {
  return (
    first.distance < second.distance || (first.distance === second.distance && first.anchorIndex < second.anchorIndex)
  );
}
