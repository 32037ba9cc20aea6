/** Updates of single Gaussians after the motion of a frame (SPEC 7.8, 8.8). */

import { checkCodes, checkPosition } from "./attributes.js";
import { indicesWhere, pick } from "./columns.js";
import * as constants from "./constants.js";
import type { StreamHeader } from "./header.js";
import { decodeSigned, sequenceModels } from "./integers.js";
import { parentClass, PARENT_CLASSES } from "./motion-contexts.js";
import { sumOfMagnitudes } from "./motion.js";
import type { Rows } from "./motion.js";
import { Model } from "./planes.js";
import type { Section } from "./planes.js";
import { demand } from "./reject.js";
import { turn } from "./rotation.js";
import { select } from "./scene.js";
import type { Scene } from "./scene.js";

/** Recency is from 0 to RECENCY_LIMIT. */
const RECENCIES = constants.RECENCY_LIMIT + 1;

/** The signs of the sum of the preceding residuals: -1, 0, 1. */
const SIGNS = 3;

/** Number of residuals per field: translation, rotation, log-scales, opacity, SH DC. */
const FIELD_SIZES = [3, 3, constants.LOG_SCALE_PLANES, constants.OPACITY_PLANES, constants.SH_DC_PLANES];

/** First rows of the residuals of translation, rotation and codes. */
const TRANSLATION_START = 0;
const ROTATION_START = 3;
const CODES_START = 6;

/** The models of updates, which persist from frame to frame. */
export class UpdateModels {
  readonly changes = new Model(PARENT_CLASSES * RECENCIES);
  readonly dies = new Model(RECENCIES);
  /** For each field: the context says which of the preceding fields change. */
  readonly fields = FIELD_SIZES.map((_, field) => new Model(2 ** field));
  readonly residuals = sequenceModels(constants.CLASS_BITS, SIGNS * constants.RESIDUAL_ROWS);
}

/** The updated Gaussians, by their indices in the scene after the motion. */
export interface Updates {
  /** Those that change and stay, ascending. */
  readonly changed: Uint32Array;
  /** Those that are deleted, ascending. */
  readonly leaving: Uint32Array;
  /** 13 rows, with a number for each Gaussian that changes and stays. */
  readonly residuals: Rows;
}

/**
 * Decode the updates of a frame.
 *
 * @param scene the scene after the motion of the frame, with the recency of the previous frame
 */
export function decodeUpdates(section: Section, models: UpdateModels, scene: Scene): Updates {
  const motionSums = sumOfMagnitudes(scene.motion);
  const contexts = scene.recency.map((recency, i) => RECENCIES * parentClass(motionSums[i]) + recency);
  const changing = indicesOfOnes(section.plane(models.changes, contexts));
  const dies = section.plane(models.dies, pick(scene.recency, changing));
  const changed = changing.filter((_, place) => dies[place] === 0);
  return {
    changed,
    leaving: changing.filter((_, place) => dies[place] === 1),
    residuals: decodeResiduals(section, models, changed.length),
  };
}

/** The scene after the updates. */
export function applyUpdates(updates: Updates, scene: Scene, header: StreamHeader): Scene {
  const count = scene.ids.length;
  const { changed, leaving, residuals } = updates;
  demand(leaving.length < count, "count", `updates delete all ${count} Gaussians`);
  const updated = {
    ...scene,
    positions: scene.positions.map((column, axis) =>
      translate(column, changed, residuals[TRANSLATION_START + axis], header.translationStep),
    ),
    rotations: turnChanged(scene.rotations, changed, residuals.slice(ROTATION_START, CODES_START), header),
    codes: updateCodes(scene.codes, changed, residuals.slice(CODES_START)),
    recency: nextRecency(scene.recency, changed),
  };
  const leaves = new Uint8Array(count);
  for (const i of leaving) leaves[i] = 1;
  return select(
    updated,
    indicesWhere(count, (i) => leaves[i] === 0),
  );
}

/** Decode 13 rows of `count` residuals: which fields change, then the residuals of each field, row by row. */
function decodeResiduals(section: Section, models: UpdateModels, count: number): Rows {
  const members = decodeFields(section, models.fields, count);
  const rows: Int32Array[] = [];
  FIELD_SIZES.forEach((size, field) => {
    const sums = new Int32Array(count);
    for (let i = 0; i < size; i++) rows.push(decodeRow(section, models, rows.length, members[field], sums));
  });
  return rows;
}

/** For each field, the indices below `count` where it changes; the preceding answers are the context. */
export function decodeFields(section: Section, models: readonly Model[], count: number): Uint32Array[] {
  const answers = new Int32Array(count);
  return models.map((model, field) => {
    const bits = section.plane(model, answers);
    bits.forEach((bit, i) => {
      answers[i] += bit * 2 ** field;
    });
    return indicesOfOnes(bits);
  });
}

/** Decode a row of residuals, 0 except at the indices `members`, and add them to `sums`, those of the field so far. */
function decodeRow(
  section: Section,
  models: UpdateModels,
  row: number,
  members: Uint32Array,
  sums: Int32Array,
): Int32Array {
  const outer = pick(sums, members).map((sum) => SIGNS * row + 1 + Math.sign(sum));
  const residuals = new Int32Array(sums.length);
  decodeSigned(section, models.residuals, members.length, outer).forEach((residual, place) => {
    residuals[members[place]] = residual;
    sums[members[place]] += residual;
  });
  return residuals;
}

function translate(column: Int32Array, changed: Uint32Array, residuals: Int32Array, step: number): Int32Array {
  const translated = column.slice();
  changed.forEach((i, place) => {
    translated[i] = checkPosition(column[i] + step * residuals[place]);
  });
  return translated;
}

function turnChanged(rotations: Rows, changed: Uint32Array, residuals: Rows, header: StreamHeader): Int32Array[] {
  const [w, x, y, z] = rotations.map((column) => column.slice());
  const [rx, ry, rz] = residuals.map(checkTurns);
  changed.forEach((i, place) => {
    if (rx[place] === 0 && ry[place] === 0 && rz[place] === 0) return;
    const residual = [header.rotationUnity, rx[place], ry[place], rz[place]] as const;
    [w[i], x[i], y[i], z[i]] = turn([w[i], x[i], y[i], z[i]], residual);
  });
  return [w, x, y, z];
}

/** Check a row of rotation residuals and return it. */
function checkTurns(row: Int32Array): Int32Array {
  const greatest = row.reduce((most, residual) => Math.max(most, Math.abs(residual)), 0);
  demand(greatest <= constants.TURN_LIMIT, "symbol-range", `a rotation residual of magnitude ${greatest}`);
  return row;
}

/** The codes with the residuals of their rows added; SH rest is not updated. */
function updateCodes(codes: Rows, changed: Uint32Array, residuals: Rows): Int32Array[] {
  return codes.map((row, number) => {
    const updated = row.slice();
    if (number >= residuals.length) return updated;
    changed.forEach((i, place) => {
      updated[i] += residuals[number][place];
    });
    return checkCodes(updated);
  });
}

/** 0 if a Gaussian is updated, otherwise one more, up to RECENCY_LIMIT. */
function nextRecency(recency: Int32Array, changed: Uint32Array): Int32Array {
  const next = recency.map((before) => Math.min(before + 1, constants.RECENCY_LIMIT));
  for (const i of changed) next[i] = 0;
  return next;
}

export function indicesOfOnes(bits: Uint8Array): Uint32Array {
  return indicesWhere(bits.length, (i) => bits[i] === 1);
}
