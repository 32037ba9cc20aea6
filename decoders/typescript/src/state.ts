/** The state of a frame, on which the next frame depends (SPEC 7.1). */

import type { AnchorLevel } from "./anchors.js";
import { BirthModels } from "./births.js";
import { makeCanonicalScene, decodeGaussians } from "./canonical.js";
import type { CanonicalChunk, CanonicalGaussians } from "./canonical.js";
import { OWN_LIMITS } from "./constants.js";
import type { StreamHeader } from "./header.js";
import { MotionModels } from "./motion.js";
import { Declined, demand } from "./reject.js";
import type { Scene } from "./scene.js";
import { UpdateModels } from "./updates.js";

export interface State {
  readonly ordinal: number;
  readonly phase: number;
  readonly scene: Scene;
  /** The anchors of each level, beginning with level 1; empty before the first sampling. */
  readonly levels: readonly AnchorLevel[];
  /** The id of the next new Gaussian. */
  readonly nextId: number;
  /** The models of motion (by level), of updates and of births, with the counts of their contexts. */
  readonly motionModels: readonly MotionModels[];
  readonly updateModels: UpdateModels;
  readonly birthModels: BirthModels;
}

/** Decode the Gaussians of a CANO (7.2); its ordinal must be `due`, unless `due` is null. */
export function decodeCanonical(chunk: CanonicalChunk, due: number | null, header: StreamHeader): CanonicalGaussians {
  checkOrdinal(chunk.frame, due);
  demand(chunk.gaussianCount >= 1, "count", "a canonical frame has no Gaussians");
  checkCounts(chunk.gaussianCount, 0, header);
  return decodeGaussians(chunk.sections, chunk.gaussianCount, chunk, header);
}

/** Make the state of a canonical frame, which does not depend on previous frames. */
export function makeCanonicalState(ordinal: number, gaussians: CanonicalGaussians, header: StreamHeader): State {
  const scene = makeCanonicalScene(gaussians, header);
  return {
    ordinal,
    phase: 0,
    scene,
    levels: [],
    nextId: scene.ids.length,
    motionModels: Array.from({ length: header.levelCount }, () => new MotionModels()),
    updateModels: new UpdateModels(),
    birthModels: new BirthModels(),
  };
}

/** Check the ordinal of a canonical frame, unless `due` is null. */
export function checkOrdinal(frame: number, due: number | null): void {
  demand(due === null || frame === due, "frame-order", `frame ${frame} where frame ${due} was expected`);
}

/** Check counts against the level before they determine allocations (3.2). */
export function checkCounts(gaussians: number, births: number, { limits }: StreamHeader): void {
  demand(
    gaussians <= limits.gaussians,
    "count-exceeds-level",
    `${gaussians} Gaussians; the limit is ${limits.gaussians}`,
  );
  demand(births <= limits.births, "count-exceeds-level", `${births} births; the limit is ${limits.births}`);
  if (gaussians > OWN_LIMITS.gaussians)
    throw new Declined(`${gaussians} Gaussians; this decoder accepts ${OWN_LIMITS.gaussians}`);
  if (births > OWN_LIMITS.births) throw new Declined(`${births} births; this decoder accepts ${OWN_LIMITS.births}`);
}
