/** The Gaussians of a frame, column by column, in ascending id (SPEC 7.1). */

import { pick } from "./columns.js";
import type { StreamHeader } from "./header.js";
import { channelCount } from "./header.js";

/** The binding of a new Gaussian, which follows no anchor before the next frame. */
export const UNBOUND = -1;

export interface Scene {
  readonly ids: Uint32Array;
  /** x, y, z, in lattice units. */
  readonly positions: readonly Int32Array[];
  /** w, x, y, z, with 22 fraction bits. */
  readonly rotations: readonly Int32Array[];
  /** 7 rows, or 16 with SH rest. */
  readonly codes: readonly Int32Array[];
  /** For each channel, the sum of the symbols that moved the Gaussian in the last frame. */
  readonly motion: readonly Int32Array[];
  /** For each level, from 1 on, the index of the anchor that the Gaussian follows, or UNBOUND. */
  readonly binding: readonly Int32Array[];
  /** Frames since the Gaussian was born or updated, up to RECENCY_LIMIT (7.8); only in streams with updates. */
  readonly recency: Int32Array;
}

/** The columns that are coded and serialized. */
export type CodedScene = Pick<Scene, "ids" | "positions" | "rotations" | "codes">;

/** A scene of Gaussians that have not moved and follow no anchor, all with the same recency. */
export function newScene(coded: CodedScene, header: StreamHeader, recency: number): Scene {
  const count = coded.ids.length;
  return {
    ...coded,
    motion: Array.from({ length: channelCount(header) }, () => new Int32Array(count)),
    binding: Array.from({ length: header.levelCount }, () => new Int32Array(count).fill(UNBOUND)),
    recency: new Int32Array(count).fill(recency),
  };
}

/** The Gaussians at the indices `kept`, in this order. */
export function select(scene: Scene, kept: Uint32Array): Scene {
  return {
    ids: kept.map((i) => scene.ids[i]),
    positions: scene.positions.map((column) => pick(column, kept)),
    rotations: scene.rotations.map((column) => pick(column, kept)),
    codes: scene.codes.map((column) => pick(column, kept)),
    motion: scene.motion.map((column) => pick(column, kept)),
    binding: scene.binding.map((column) => pick(column, kept)),
    recency: pick(scene.recency, kept),
  };
}

/** The Gaussians of `first` followed by those of `second`. */
export function append(first: Scene, second: Scene): Scene {
  return {
    ids: join(Uint32Array, first.ids, second.ids),
    positions: joinColumns(Int32Array, first.positions, second.positions),
    rotations: joinColumns(Int32Array, first.rotations, second.rotations),
    codes: joinColumns(Int32Array, first.codes, second.codes),
    motion: joinColumns(Int32Array, first.motion, second.motion),
    binding: joinColumns(Int32Array, first.binding, second.binding),
    recency: join(Int32Array, first.recency, second.recency),
  };
}

/** The index of the Gaussian of this id, or -1 if it is not in the scene. */
export function indexOfId(ids: Uint32Array, id: number): number {
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

function join<Array extends Column<Array>>(make: new (length: number) => Array, first: Array, second: Array): Array {
  const joined = new make(first.length + second.length);
  joined.set(first);
  joined.set(second, first.length);
  return joined;
}

function joinColumns<Array extends Column<Array>>(
  make: new (length: number) => Array,
  first: readonly Array[],
  second: readonly Array[],
): Array[] {
  return first.map((column, row) => join(make, column, second[row]));
}
