/** Decodes and applies the updates of individual Gaussians after the motion of a frame (SPEC 7.8, 8.8). */

import { checkCodes, checkPosition } from "./attributes.js";
import { indicesWhere, pickColumn } from "./columns.js";
import * as constants from "./constants.js";
import type { StreamHeader } from "./header.js";
import { decodeSigned, makeSequenceModels } from "./integers.js";
import { parentClass, PARENT_CLASSES } from "./motion-contexts.js";
import { sumMagnitudes } from "./motion.js";
import type { Rows } from "./motion.js";
import { Model } from "./planes.js";
import type { Section } from "./planes.js";
import { demand } from "./reject.js";
import { rotate } from "./rotation.js";
import { selectGaussians } from "./scene.js";
import type { Scene } from "./scene.js";

/** Number of values of recency, which is from 0 to RECENCY_LIMIT. */
const RECENCY_COUNT = constants.RECENCY_LIMIT + 1;

/** Number of signs of a sum of residuals: -1, 0, 1. */
const SIGN_COUNT = 3;

/** Number of residuals per field: translation, rotation, log-scales, opacity, SH DC. */
const FIELD_SIZES = [3, 3, constants.LOG_SCALE_PLANES, constants.OPACITY_PLANES, constants.SH_DC_PLANES];

/** First rows of the residuals of translation, rotation and codes. */
const TRANSLATION_START = 0;
const ROTATION_START = 3;
const CODES_START = 6;

/** The models of updates; their counts persist from frame to frame. */
export class UpdateModels {
  readonly changes = new Model(PARENT_CLASSES * RECENCY_COUNT);
  readonly isDeleted = new Model(RECENCY_COUNT);
  /** For each field; the context tells which of the preceding fields change. */
  readonly fields = FIELD_SIZES.map((_, field) => new Model(2 ** field));
  readonly residuals = makeSequenceModels(constants.CLASS_BITS, SIGN_COUNT * constants.RESIDUAL_ROWS);
}

/** The updates of a frame; indices refer to the scene after the motion. */
export interface Updates {
  /** Indices of the Gaussians that change and survive, ascending. */
  readonly changedIndices: Uint32Array;
  /** Indices of the Gaussians that are deleted, ascending. */
  readonly deletedIndices: Uint32Array;
  /** 13 rows, with a number for each Gaussian that changes and survives. */
  readonly residuals: Rows;
}

/**
 * Decode the updates of a frame.
 *
 * @param scene the scene after the motion of the frame; its `recency` is that of the previous frame
 */
export function decodeUpdates(section: Section, models: UpdateModels, scene: Scene): Updates {
  const motionSums = sumMagnitudes(scene.motion);
  const contexts = scene.recency.map((recency, i) => RECENCY_COUNT * parentClass(motionSums[i]) + recency);
  const updatedIndices = findOnes(section.decodePlane(models.changes, contexts));
  const isDeleted = section.decodePlane(models.isDeleted, pickColumn(scene.recency, updatedIndices));
  const changedIndices = updatedIndices.filter((_, index) => isDeleted[index] === 0);
  return {
    changedIndices,
    deletedIndices: updatedIndices.filter((_, index) => isDeleted[index] === 1),
    residuals: decodeResiduals(section, models, changedIndices.length),
  };
}

/** Return the scene after the updates. */
export function applyUpdates(updates: Updates, scene: Scene, header: StreamHeader): Scene {
  const count = scene.ids.length;
  const { changedIndices, deletedIndices, residuals } = updates;
  demand(deletedIndices.length < count, "count", `updates delete all ${count} Gaussians`);
  const updated = {
    ...scene,
    positions: scene.positions.map((column, axis) =>
      translate(column, changedIndices, residuals[TRANSLATION_START + axis], header.translationStep),
    ),
    rotations: rotateChanged(scene.rotations, changedIndices, residuals.slice(ROTATION_START, CODES_START), header),
    codes: updateCodes(scene.codes, changedIndices, residuals.slice(CODES_START)),
    recency: nextRecency(scene.recency, changedIndices),
  };
  const deletedFlags = new Uint8Array(count);
  for (const i of deletedIndices) deletedFlags[i] = 1;
  return selectGaussians(
    updated,
    indicesWhere(count, (i) => deletedFlags[i] === 0),
  );
}

/** Decode 13 rows of `count` residuals: first which fields change, then the residuals of each field by row. */
function decodeResiduals(section: Section, models: UpdateModels, count: number): Rows {
  const changedIndices = decodeFields(section, models.fields, count);
  const rows: Int32Array[] = [];
  FIELD_SIZES.forEach((size, field) => {
    const sums = new Int32Array(count);
    for (let i = 0; i < size; i++) rows.push(decodeRow(section, models, rows.length, changedIndices[field], sums));
  });
  return rows;
}

/** Decode, for each field, the indices below `count` at which it changes; earlier fields are the context. */
export function decodeFields(section: Section, models: readonly Model[], count: number): Uint32Array[] {
  const changedFields = new Int32Array(count);
  return models.map((model, field) => {
    const bits = section.decodePlane(model, changedFields);
    bits.forEach((bit, i) => {
      changedFields[i] += bit * 2 ** field;
    });
    return findOnes(bits);
  });
}

/** Decode a row of residuals, which are 0 except at `changedIndices`, and add them to the sums of their field. */
function decodeRow(
  section: Section,
  models: UpdateModels,
  row: number,
  changedIndices: Uint32Array,
  sums: Int32Array,
): Int32Array {
  const outer = pickColumn(sums, changedIndices).map((sum) => SIGN_COUNT * row + 1 + Math.sign(sum));
  const residuals = new Int32Array(sums.length);
  decodeSigned(section, models.residuals, changedIndices.length, outer).forEach((residual, index) => {
    residuals[changedIndices[index]] = residual;
    sums[changedIndices[index]] += residual;
  });
  return residuals;
}

function translate(column: Int32Array, changedIndices: Uint32Array, residuals: Int32Array, step: number): Int32Array {
  const translated = column.slice();
  changedIndices.forEach((i, index) => {
    translated[i] = checkPosition(column[i] + step * residuals[index]);
  });
  return translated;
}

function rotateChanged(
  rotations: Rows,
  changedIndices: Uint32Array,
  residuals: Rows,
  header: StreamHeader,
): Int32Array[] {
  const [w, x, y, z] = rotations.map((column) => column.slice());
  const [rx, ry, rz] = residuals.map(checkRotationResiduals);
  changedIndices.forEach((i, index) => {
    if (rx[index] === 0 && ry[index] === 0 && rz[index] === 0) return;
    const residual = [header.rotationUnity, rx[index], ry[index], rz[index]] as const;
    [w[i], x[i], y[i], z[i]] = rotate([w[i], x[i], y[i], z[i]], residual);
  });
  return [w, x, y, z];
}

/** Check that every number of a row is in the range of rotation residuals, and return the row. */
function checkRotationResiduals(row: Int32Array): Int32Array {
  const maxMagnitude = row.reduce((max, residual) => Math.max(max, Math.abs(residual)), 0);
  demand(maxMagnitude <= constants.TURN_LIMIT, "symbol-range", `a rotation residual of magnitude ${maxMagnitude}`);
  return row;
}

/** Return the codes with their residuals added; SH rest has no residuals. */
function updateCodes(codes: Rows, changedIndices: Uint32Array, residuals: Rows): Int32Array[] {
  return codes.map((row, number) => {
    const updated = row.slice();
    if (number >= residuals.length) return updated;
    changedIndices.forEach((i, index) => {
      updated[i] += residuals[number][index];
    });
    return checkCodes(updated);
  });
}

/** Return the next recency: 0 for updated Gaussians, otherwise one more, up to RECENCY_LIMIT. */
function nextRecency(recency: Int32Array, changedIndices: Uint32Array): Int32Array {
  const next = recency.map((previousRecency) => Math.min(previousRecency + 1, constants.RECENCY_LIMIT));
  for (const i of changedIndices) next[i] = 0;
  return next;
}

export function findOnes(bits: Uint8Array): Uint32Array {
  return indicesWhere(bits.length, (i) => bits[i] === 1);
}
