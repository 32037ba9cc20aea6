/** The state of a frame, which seeds the next (SPEC 7.1). */

import type { AnchorLevel } from "./anchors.js";
import { BirthModels } from "./births.js";
import { decodeCanonicalScene } from "./canonical.js";
import type { CanonicalChunk } from "./canonical.js";
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
  /** The anchors of each level, from 1 on; none before the first sampling. */
  readonly levels: readonly AnchorLevel[];
  /** The id that the next newborn gets. */
  readonly nextId: number;
  /** The counts of the contexts of motion, level by level from 1 on, of updates and of births. */
  readonly motionModels: readonly MotionModels[];
  readonly updateModels: UpdateModels;
  readonly birthModels: BirthModels;
}

/** The state of a canonical frame (7.2), whose ordinal is `due`, or any where this is null. */
export function decodeCanonical(chunk: CanonicalChunk, due: number | null, header: StreamHeader): State {
  demand(due === null || chunk.frame === due, "frame-order", `frame ${chunk.frame} where ${due} is due`);
  demand(chunk.gaussianCount >= 1, "count", "a canonical frame without Gaussians");
  checkCounts(chunk.gaussianCount, 0, header);
  return {
    ordinal: chunk.frame,
    phase: 0,
    scene: decodeCanonicalScene(chunk, header),
    levels: [],
    nextId: chunk.gaussianCount,
    motionModels: Array.from({ length: header.levelCount }, () => new MotionModels()),
    updateModels: new UpdateModels(),
    birthModels: new BirthModels(),
  };
}

/** Hold counts against the level before memory is allocated by them (3.2). */
export function checkCounts(gaussians: number, births: number, { limits }: StreamHeader): void {
  demand(gaussians <= limits.gaussians, "count-exceeds-level", `${gaussians} Gaussians`);
  demand(births <= limits.births, "count-exceeds-level", `${births} births`);
  if (gaussians > OWN_LIMITS.gaussians) throw new Declined(`${gaussians} Gaussians`);
  if (births > OWN_LIMITS.births) throw new Declined(`${births} births`);
}
