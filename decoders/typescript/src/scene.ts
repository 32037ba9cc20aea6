/** The Gaussians of a frame, column by column, ordered by id (SPEC 7.1). */

import { pickColumn } from "./columns.js";
import type { StreamHeader } from "./header.js";
import { channelCount } from "./header.js";

/** The binding of a new Gaussian, which is bound in the next frame. */
export const UNBOUND = -1;

export interface Scene {
  readonly ids: Uint32Array;
  /** x, y, z, in lattice units. */
  readonly positions: readonly Int32Array[];
  /** w, x, y, z, with 22 fraction bits. */
  readonly rotations: readonly Int32Array[];
  /** 7 rows, or 16 with SH rest. */
  readonly codes: readonly Int32Array[];
  /** For each channel, the sum of the symbols that moved the Gaussian in this frame. */
  readonly motion: readonly Int32Array[];
  /** For each level, beginning with level 1, the index of the anchor to which the Gaussian is bound, or UNBOUND. */
  readonly binding: readonly Int32Array[];
  /** Number of frames since the birth or the last update, up to RECENCY_LIMIT (7.8); used only with updates. */
  readonly recency: Int32Array;
}

/** The columns that are coded and serialized. */
export type CodedScene = Pick<Scene, "ids" | "positions" | "rotations" | "codes">;

/** Make a scene of Gaussians without motion and bindings, all with the same recency. */
export function makeScene(coded: CodedScene, header: StreamHeader, recency: number): Scene {
  const count = coded.ids.length;
  return {
    ...coded,
    motion: Array.from({ length: channelCount(header) }, () => new Int32Array(count)),
    binding: Array.from({ length: header.levelCount }, () => new Int32Array(count).fill(UNBOUND)),
    recency: new Int32Array(count).fill(recency),
  };
}

/** Return the Gaussians at `indices`, in this order. */
export function selectGaussians(scene: Scene, indices: Uint32Array): Scene {
  return {
    ids: indices.map((i) => scene.ids[i]),
    positions: scene.positions.map((column) => pickColumn(column, indices)),
    rotations: scene.rotations.map((column) => pickColumn(column, indices)),
    codes: scene.codes.map((column) => pickColumn(column, indices)),
    motion: scene.motion.map((column) => pickColumn(column, indices)),
    binding: scene.binding.map((column) => pickColumn(column, indices)),
    recency: pickColumn(scene.recency, indices),
  };
}

/** Return the Gaussians of `first`, followed by the Gaussians of `second`. */
export function appendScenes(first: Scene, second: Scene): Scene {
  return {
    ids: joinArrays(Uint32Array, first.ids, second.ids),
    positions: joinColumns(Int32Array, first.positions, second.positions),
    rotations: joinColumns(Int32Array, first.rotations, second.rotations),
    codes: joinColumns(Int32Array, first.codes, second.codes),
    motion: joinColumns(Int32Array, first.motion, second.motion),
    binding: joinColumns(Int32Array, first.binding, second.binding),
    recency: joinArrays(Int32Array, first.recency, second.recency),
  };
}

/** Return the index of an id in `ids`, which are ascending; -1 if the id is missing. */
export function findId(ids: Uint32Array, id: number): number {
  let low = 0;
  let high = ids.length;
  while (low < high) {
    const middle = (low + high) >>> 1;
    if (ids[middle] < id) low = middle + 1;
    else high = middle;
  }
  return ids[low] === id ? low : -1;
}

interface Column<Self> {
  readonly length: number;
  set(values: Self, offset?: number): void;
}

function joinArrays<Array extends Column<Array>>(
  arrayType: new (length: number) => Array,
  first: Array,
  second: Array,
): Array {
  const result = new arrayType(first.length + second.length);
  result.set(first);
  result.set(second, first.length);
  return result;
}

function joinColumns<Array extends Column<Array>>(
  arrayType: new (length: number) => Array,
  first: readonly Array[],
  second: readonly Array[],
): Array[] {
  return first.map((column, row) => joinArrays(arrayType, column, second[row]));
}
