/** Samples the anchors of all levels, and binds Gaussians to them (SPEC 6.3 to 6.5). */

import { pickColumn, tabulate } from "./columns.js";
import type { StreamHeader } from "./header.js";
import { AnchorSearch } from "./nearest.js";
import { sampleAnchors } from "./sampler.js";
import { UNBOUND } from "./scene.js";
import type { Scene } from "./scene.js";

/** The anchors of a level, ordered by id. */
export interface AnchorLevel {
  /** The ids of the Gaussians at which the anchors are, ascending. */
  readonly ids: Uint32Array;
  readonly search: AnchorSearch;
  /** Index of each anchor's parent in the next coarser level; all 0 for level L, which has no coarser level. */
  readonly parents: Int32Array;
}

/** Sample anchors, and bind every Gaussian. Return the levels, beginning with level 1, and the bound scene. */
export function sampleAndBind(scene: Scene, phase: number, header: StreamHeader): [AnchorLevel[], Scene] {
  const indicesByLevel = sampleAnchors(scene, phase, header);
  const searches = indicesByLevel.map(
    (indices) => new AnchorSearch(scene.positions.map((column) => pickColumn(column, indices))),
  );
  const binding = searches.map((search) => bindScene(scene, search));
  const levels = indicesByLevel.map((indices, level) => ({
    ids: indices.map((i) => scene.ids[i]),
    search: searches[level],
    parents: level + 1 < binding.length ? pickColumn(binding[level + 1], indices) : new Int32Array(indices.length),
  }));
  return [levels, { ...scene, binding }];
}

/** Bind the new Gaussians of the previous frame to the current anchors. */
export function bindNewborn(scene: Scene, levels: readonly AnchorLevel[]): Scene {
  const binding = scene.binding.map((column, level) =>
    column.map((anchor, i) => (anchor === UNBOUND ? findNearest(scene, i, levels[level].search) : anchor)),
  );
  return { ...scene, binding };
}

function bindScene(scene: Scene, search: AnchorSearch): Int32Array {
  return tabulate(scene.ids.length, (i) => findNearest(scene, i, search));
}

function findNearest({ positions: [x, y, z] }: Scene, index: number, search: AnchorSearch): number {
  return search.findNearest([x[index], y[index], z[index]]);
}
