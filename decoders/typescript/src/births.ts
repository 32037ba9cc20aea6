/** Births, which are coded relative to their parents (SPEC 7.6, 8.6). */

import {
  AttributeModels,
  checkPosition,
  decodeRotations,
  decodeRowsAlike,
  decodeRowsApart,
  decodeShDc,
  expandRotations,
  sum,
  checkCodes,
} from "./attributes.js";
import * as constants from "./constants.js";
import type { StreamHeader } from "./header.js";
import { decodeAscending, sequenceModels } from "./integers.js";
import type { Section } from "./planes.js";
import { newScene } from "./scene.js";
import type { Scene } from "./scene.js";

/** The recency of a new Gaussian (7.8). */
const NEWBORN_RECENCY = 0;

/** The models of births, which persist from frame to frame. */
export class BirthModels extends AttributeModels {
  readonly parents = sequenceModels(constants.KEY_CLASS_BITS);
  readonly positions = sequenceModels(constants.CLASS_BITS);
  readonly shRest = sequenceModels(constants.CLASS_BITS);
}

/**
 * Decode the births of a frame.
 *
 * @param scene the scene with the possible parents: after the deaths, motion and updates of the frame
 * @param firstId the id of the first new Gaussian
 */
export function decodeNewborn(
  section: Section,
  models: BirthModels,
  scene: Scene,
  header: StreamHeader,
  count: number,
  firstId: number,
): Scene {
  const limit = BigInt(scene.ids.length);
  const parents = decodeAscending(section, models.parents, count, limit, "parent-range");
  const residuals = decodeRowsAlike(section, models.positions, 3, count);
  const dc = decodeShDc(section, models, count);
  const opacity = decodeRowsApart(section, models.opacity, constants.OPACITY_PLANES, count);
  const logScales = decodeLogScales(section, models, count);
  const rotations = expandRotations(decodeRotations(section, models, count), header.rotationBits);
  const restRows = header.shDegree === 1 ? constants.SH_REST_PLANES : 0;
  const rest = decodeRowsAlike(section, models.shRest, restRows, count);
  const positions = scene.positions.map((column, axis) =>
    residuals[axis].map((residual, i) => checkPosition(column[Number(parents[i])] + header.positionStep * residual)),
  );
  const codes = [...[...logScales, ...opacity].map(checkCodes), ...dc, ...rest.map(checkCodes)];
  const ids = new Uint32Array(count).map((_, i) => firstId + i);
  return newScene({ ids, positions, rotations, codes }, header, NEWBORN_RECENCY);
}

/** Log-scales x, y, z, from x, y - x and z - y. */
function decodeLogScales(section: Section, models: BirthModels, count: number): Int32Array[] {
  const [x, yLess, zLess] = decodeRowsApart(section, models.logScales, constants.LOG_SCALE_PLANES, count);
  const y = sum(x, yLess);
  return [x, y, sum(y, zLess)];
}
