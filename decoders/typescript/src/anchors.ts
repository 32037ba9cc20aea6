/** The anchors of all levels, and the bindings until the next sampling (SPEC 6.3 to 6.5). */

import { pick, tabulate } from "./columns.js";
import type { StreamHeader } from "./header.js";
import { AnchorSearch } from "./nearest.js";
import { sampleAnchors } from "./sampler.js";
import { UNBOUND } from "./scene.js";
import type { Scene } from "./scene.js";

/** The anchors of a level, in order. */
export interface AnchorLevel {
  /** The ids of their Gaussians, ascending. */
  readonly ids: Uint32Array;
  readonly search: AnchorSearch;
  /** Index of each anchor's parent in the next coarser level; all 0 for level L, which has none. */
  readonly parents: Int32Array;
}

/** Sample anchors and bind every Gaussian. Returns the levels, from 1 on, and the scene with its bindings. */
export function sampleAndBind(scene: Scene, phase: number, header: StreamHeader): [AnchorLevel[], Scene] {
  const indices = sampleAnchors(scene, phase, header);
  const searches = indices.map((of) => new AnchorSearch(scene.positions.map((column) => pick(column, of))));
  const binding = searches.map((search) => bindAll(scene, search));
  const levels = indices.map((of, level) => ({
    ids: of.map((i) => scene.ids[i]),
    search: searches[level],
    parents: level + 1 < binding.length ? pick(binding[level + 1], of) : new Int32Array(of.length),
  }));
  return [levels, { ...scene, binding }];
}

/** Bind the new Gaussians of the previous frame to the current anchors. */
export function bindNewborn(scene: Scene, levels: readonly AnchorLevel[]): Scene {
  const binding = scene.binding.map((column, level) =>
    column.map((anchor, i) => (anchor === UNBOUND ? nearest(scene, i, levels[level].search) : anchor)),
  );
  return { ...scene, binding };
}

function bindAll(scene: Scene, search: AnchorSearch): Int32Array {
  return tabulate(scene.ids.length, (i) => nearest(scene, i, search));
}

function nearest({ positions: [x, y, z] }: Scene, index: number, search: AnchorSearch): number {
  return search.nearest([x[index], y[index], z[index]]);
}
