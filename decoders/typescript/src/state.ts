/** The state of a frame, on which the next frame depends (SPEC 7.1). */

import type { AnchorLevel } from "./anchors.js";
import { BirthModels } from "./births.js";
import { canonicalScene, decodeGaussians } from "./canonical.js";
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
  /** The anchors of each level, from 1 on; empty before the first sampling. */
  readonly levels: readonly AnchorLevel[];
  /** The id of the next new Gaussian. */
  readonly nextId: number;
  /** The counts of the contexts of motion (level by level, from 1 on), of updates and of births. */
  readonly motionModels: readonly MotionModels[];
  readonly updateModels: UpdateModels;
  readonly birthModels: BirthModels;
}

/** Decode the Gaussians of a CANO (7.2) whose frame ordinal must be `due`, unless that is null. */
export function decodeCanonical(chunk: CanonicalChunk, due: number | null, header: StreamHeader): CanonicalGaussians {
  checkOrdinal(chunk.frame, due);
  demand(chunk.gaussianCount >= 1, "count", "a canonical frame without Gaussians");
  checkCounts(chunk.gaussianCount, 0, header);
  return decodeGaussians(chunk.sections, chunk.gaussianCount, chunk, header);
}

/** The state of a canonical frame, which is independent of previous frames. */
export function canonicalState(ordinal: number, gaussians: CanonicalGaussians, header: StreamHeader): State {
  const scene = canonicalScene(gaussians, header);
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

/** Check the ordinal of a canonical frame, if one is expected. */
export function checkOrdinal(frame: number, due: number | null): void {
  demand(due === null || frame === due, "frame-order", `frame ${frame} where frame ${due} was expected`);
}

/** Check counts against the level before they determine allocations (3.2). */
export function checkCounts(gaussians: number, births: number, { limits }: StreamHeader): void {
  demand(gaussians <= limits.gaussians, "count-exceeds-level", `${gaussians} Gaussians`);
  demand(births <= limits.births, "count-exceeds-level", `${births} births`);
  if (gaussians > OWN_LIMITS.gaussians) throw new Declined(`${gaussians} Gaussians`);
  if (births > OWN_LIMITS.births) throw new Declined(`${births} births`);
}
