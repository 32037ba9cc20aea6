/**
 * Exact search for the nearest anchor (SPEC 6.4), in a tree of bounding boxes.
 *
 * Coordinates differ by less than 2^24, so squared distances are below 2^50 and exact. A box is skipped if it is
 * farther than the best anchor so far, or at the same distance without a lower index, so that the result is the anchor
 * with the lowest (squared distance, index). The boxes form a binary heap: 1 is the root, and the halves of k are 2k
 * and 2k + 1. Every box holds a range of the anchors, in the order that construction gives them.
 */

import { bitLength } from "./arithmetic.js";
import { allIndices } from "./columns.js";

export type Point = readonly [number, number, number];

/** Maximum number of anchors in a leaf. */
const LEAF_ANCHORS = 8;

/** A squared distance and the index of an anchor. */
interface Best {
  distance: number;
  number: number;
}

/** Half of a box, with the minimum distance and the lowest index of the anchors in it. */
interface Half extends Best {
  readonly box: number;
  readonly start: number;
  readonly end: number;
}

export class AnchorSearch {
  readonly #positions: readonly Int32Array[];
  /** Indices of the anchors, grouped by box. */
  readonly #numbers: Uint32Array;
  /** For every box and axis, the minimum and maximum coordinate. */
  readonly #least: readonly Int32Array[];
  readonly #greatest: readonly Int32Array[];
  /** For every box, the lowest index of its anchors. */
  readonly #lowest: Uint32Array;

  /** @param positions x, y, z of the anchors, at least one */
  constructor(positions: readonly Int32Array[]) {
    const count = positions[0].length;
    const boxes = 2 ** (bitLength(Math.ceil(count / LEAF_ANCHORS)) + 1);
    this.#positions = positions;
    this.#numbers = allIndices(count);
    this.#least = positions.map(() => new Int32Array(boxes));
    this.#greatest = positions.map(() => new Int32Array(boxes));
    this.#lowest = new Uint32Array(boxes);
    this.#build(1, 0, count);
  }

  /** The index of the anchor that a Gaussian at `point` follows. */
  nearest(point: Point): number {
    const best = { distance: Infinity, number: Infinity };
    this.#search(1, 0, this.#numbers.length, point, best);
    return best.number;
  }

  #build(box: number, start: number, end: number): void {
    const run = this.#numbers.subarray(start, end);
    this.#lowest[box] = run.reduce((lowest, n) => Math.min(lowest, n), Infinity);
    this.#positions.forEach((column, axis) => {
      this.#least[axis][box] = run.reduce((least, n) => Math.min(least, column[n]), Infinity);
      this.#greatest[axis][box] = run.reduce((greatest, n) => Math.max(greatest, column[n]), -Infinity);
    });
    if (run.length <= LEAF_ANCHORS) return;
    const column = this.#positions[this.#widestAxis(box)];
    // Sort equal coordinates by index, so that among many anchors at one position the lowest index is in the first
    // half.
    run.sort((m, n) => column[m] - column[n] || m - n);
    const middle = (start + end) >>> 1;
    this.#build(2 * box, start, middle);
    this.#build(2 * box + 1, middle, end);
  }

  /** Search the halves of a box, or the anchors of a leaf, for one that precedes `best`. */
  #search(box: number, start: number, end: number, point: Point, best: Best): void {
    if (end - start <= LEAF_ANCHORS) {
      for (let place = start; place < end; place++) this.#offer(this.#numbers[place], point, best);
      return;
    }
    const middle = (start + end) >>> 1;
    const halves: [Half, Half] = [
      this.#half(2 * box, start, middle, point),
      this.#half(2 * box + 1, middle, end, point),
    ];
    if (precedes(halves[1], halves[0])) halves.reverse();
    for (const half of halves) {
      if (precedes(half, best)) this.#search(half.box, half.start, half.end, point, best);
    }
  }

  #half(box: number, start: number, end: number, point: Point): Half {
    return { box, start, end, distance: this.#distanceToBox(box, point), number: this.#lowest[box] };
  }

  #offer(number: number, point: Point, best: Best): void {
    let distance = 0;
    for (let axis = 0; axis < 3; axis++) distance += (point[axis] - this.#positions[axis][number]) ** 2;
    if (!precedes({ distance, number }, best)) return;
    best.distance = distance;
    best.number = number;
  }

  /** Squared distance from `point` to the box; 0 inside. */
  #distanceToBox(box: number, point: Point): number {
    let sum = 0;
    for (let axis = 0; axis < 3; axis++) {
      sum += Math.max(this.#least[axis][box] - point[axis], 0, point[axis] - this.#greatest[axis][box]) ** 2;
    }
    return sum;
  }

  #widestAxis(box: number): number {
    const widths = [0, 1, 2].map((axis) => this.#greatest[axis][box] - this.#least[axis][box]);
    return widths.indexOf(Math.max(...widths));
  }
}

function precedes(first: Best, second: Best): boolean {
  return first.distance < second.distance || (first.distance === second.distance && first.number < second.number);
}
