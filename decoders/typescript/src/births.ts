/** Decodes births, whose positions are coded relative to their parents (SPEC 7.6, 8.6). */

import {
  AttributeModels,
  checkPosition,
  decodeRotations,
  decodeRowsInOneContext,
  decodeRowsByContext,
  decodeShDc,
  expandRotations,
  addColumns,
  checkCodes,
} from "./attributes.js";
import * as constants from "./constants.js";
import type { StreamHeader } from "./header.js";
import { decodeAscending, makeSequenceModels } from "./integers.js";
import type { Section } from "./planes.js";
import { makeScene } from "./scene.js";
import type { Scene } from "./scene.js";

/** The recency of a new Gaussian (7.8). */
const NEWBORN_RECENCY = 0;

/** The models of births, which persist from frame to frame. */
export class BirthModels extends AttributeModels {
  readonly parents = makeSequenceModels(constants.KEY_CLASS_BITS);
  readonly positions = makeSequenceModels(constants.CLASS_BITS);
  readonly shRest = makeSequenceModels(constants.CLASS_BITS);
}

/**
 * Decode the births of a frame.
 *
 * @param scene the scene after the deaths, motion and updates of the frame; it contains the parents
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
  const residuals = decodeRowsInOneContext(section, models.positions, 3, count);
  const shDc = decodeShDc(section, models, count);
  const opacity = decodeRowsByContext(section, models.opacity, constants.OPACITY_PLANES, count);
  const logScales = decodeLogScales(section, models, count);
  const rotations = expandRotations(decodeRotations(section, models, count), header.rotationBits);
  const shRestRows = header.shDegree === 1 ? constants.SH_REST_PLANES : 0;
  const shRest = decodeRowsInOneContext(section, models.shRest, shRestRows, count);
  const positions = scene.positions.map((column, axis) =>
    residuals[axis].map((residual, i) => checkPosition(column[Number(parents[i])] + header.positionStep * residual)),
  );
  const codes = [...[...logScales, ...opacity].map(checkCodes), ...shDc, ...shRest.map(checkCodes)];
  const ids = new Uint32Array(count).map((_, i) => firstId + i);
  return makeScene({ ids, positions, rotations, codes }, header, NEWBORN_RECENCY);
}

/** Decode x, y - x and z - y; return the log-scales x, y and z. */
function decodeLogScales(section: Section, models: BirthModels, count: number): Int32Array[] {
  const [x, yDifference, zDifference] = decodeRowsByContext(
    section,
    models.logScales,
    constants.LOG_SCALE_PLANES,
    count,
  );
  const y = addColumns(x, yDifference);
  return [x, y, addColumns(y, zDifference)];
}
