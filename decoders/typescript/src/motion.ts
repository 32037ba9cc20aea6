/**
 * The symbols of the anchors (SPEC 8.7): levels from the coarsest to the finest, in contexts of the expected symbols.
 */

import type { AnchorLevel } from "./anchors.js";
import { allIndices, indicesWhere, pick, tabulate } from "./columns.js";
import { MAGNITUDE_PLANES } from "./constants.js";
import * as contexts from "./motion-contexts.js";
import { Model } from "./planes.js";
import type { Section } from "./planes.js";
import { indexOfId } from "./scene.js";
import type { Scene } from "./scene.js";

/** One row per channel, with a number for every anchor of a level. */
export type Rows = readonly Int32Array[];

/** The models of a level, which persist from frame to frame. */
export class MotionModels {
  readonly moves = new Model(contexts.MOVES_CONTEXTS);
  readonly translationNotZero = new Model(contexts.NOT_ZERO_CONTEXTS);
  readonly wNotZero = new Model(contexts.NOT_ZERO_CONTEXTS);
  readonly rotationNotZero = new Model(contexts.NOT_ZERO_CONTEXTS);
  readonly sign = new Model(contexts.SIGN_CONTEXTS);
  readonly magnitude = new Model(contexts.MAGNITUDE_CONTEXTS);

  /** The model of "not 0" for each of 6 or 7 channels, by its kind. */
  notZero(channelCount: number): Model[] {
    const { translationNotZero: t, wNotZero: w, rotationNotZero: r } = this;
    return channelCount === 6 ? [t, t, t, r, r, r] : [t, t, t, w, r, r, r];
  }
}

/**
 * Decode the symbols of all levels, from 1 on.
 *
 * @param scene the scene before the motion, with the motion of the previous frame
 */
export function decodeMotion(
  section: Section,
  models: readonly MotionModels[],
  levels: readonly AnchorLevel[],
  scene: Scene,
  previousContexts: boolean,
): Rows[] {
  const symbols: Rows[] = [];
  let coarser = null;
  for (let level = levels.length - 1; level >= 0; level--) {
    const anchors = levels[level];
    const ofParents: Rows = inheritRows(anchors, coarser?.symbols, scene.motion.length);
    const done = addRows(inheritRows(anchors, coarser?.done, scene.motion.length), ofParents);
    const own = previousContexts ? ownMotion(anchors, scene) : zeroRows(anchors.ids.length, scene.motion.length);
    const expected = own.map((row, channel) => row.map((motion, a) => motion - done[channel][a]));
    symbols[level] = decodeLevel(section, models[level], expected, sumOfMagnitudes(ofParents));
    coarser = { symbols: symbols[level], done };
  }
  return symbols;
}

/** The motion of the anchors' own Gaussians in the previous frame; 0 if they have died. */
function ownMotion(anchors: AnchorLevel, scene: Scene): Rows {
  const indices = tabulate(anchors.ids.length, (anchor) => indexOfId(scene.ids, anchors.ids[anchor]));
  return scene.motion.map((row) => indices.map((i) => (i < 0 ? 0 : row[i])));
}

function decodeLevel(section: Section, models: MotionModels, expected: Rows, parentSums: Int32Array): Rows {
  const count = parentSums.length;
  const expectedSums = sumOfMagnitudes(expected);
  const moves = section.plane(
    models.moves,
    parentSums.map((sum, anchor) => contexts.movesContext(sum, expectedSums[anchor])),
  );
  const moving = indicesWhere(count, (anchor) => moves[anchor] === 1);
  const places = decodeNotZero(section, models, expected, moving);
  const expectedThere = tabulate(places.length, (i) => expected[Math.floor(places[i] / count)][places[i] % count]);
  const rows = zeroRows(count, expected.length);
  decodeSymbols(section, models, expectedThere).forEach((symbol, i) => {
    rows[Math.floor(places[i] / count)][places[i] % count] = symbol;
  });
  return rows;
}

/** The positions of the nonzero symbols, channel by channel: channel x anchors of the level + anchor. */
function decodeNotZero(section: Section, models: MotionModels, expected: Rows, moving: Uint32Array): Uint32Array {
  const notZeroBefore = new Uint8Array(moving.length);
  const places = models.notZero(expected.length).map((model, channel) => {
    const row = expected[channel];
    const asked = pick(row, moving).map((wanted, i) => contexts.notZeroContext(wanted, notZeroBefore[i]));
    const bits = section.plane(model, asked);
    bits.forEach((bit, i) => {
      notZeroBefore[i] += bit;
    });
    return moving.filter((_, i) => bits[i] === 1).map((anchor) => channel * row.length + anchor);
  });
  return joinAll(places);
}

/** Decode nonzero symbols, with `expected` as their expected values: signs, then magnitudes. */
function decodeSymbols(section: Section, models: MotionModels, expected: Int32Array): Int32Array {
  const negative = section.plane(models.sign, expected.map(contexts.signContext));
  const towards = expected.map((wanted, i) => (negative[i] ? -wanted : wanted));
  const symbols = new Int32Array(expected.length).fill(1);
  let asked = allIndices(expected.length);
  for (let plane = 0; plane < MAGNITUDE_PLANES && asked.length > 0; plane++) {
    const asking = pick(towards, asked).map((wanted) => contexts.magnitudeContext(plane, wanted));
    const above = section.plane(models.magnitude, asking);
    asked = asked.filter((_, place) => above[place] === 1);
    for (const i of asked) symbols[i] += 1;
  }
  return symbols.map((magnitude, i) => (negative[i] ? -magnitude : magnitude));
}

/** For every anchor, the numbers of its parent; 0 if there is no coarser level. */
function inheritRows(anchors: AnchorLevel, coarser: Rows | undefined, channelCount: number): Rows {
  if (coarser === undefined) return zeroRows(anchors.ids.length, channelCount);
  return coarser.map((row) => anchors.parents.map((parent) => row[parent]));
}

function addRows(first: Rows, second: Rows): Rows {
  return first.map((row, channel) => row.map((number, anchor) => number + second[channel][anchor]));
}

/** For every anchor, the sum of its magnitudes over all channels. */
export function sumOfMagnitudes(rows: Rows): Int32Array {
  return rows[0].map((_, anchor) => rows.reduce((sum, row) => sum + Math.abs(row[anchor]), 0));
}

function zeroRows(count: number, channelCount: number): Rows {
  return Array.from({ length: channelCount }, () => new Int32Array(count));
}

function joinAll(parts: readonly Uint32Array[]): Uint32Array {
  const joined = new Uint32Array(parts.reduce((sum, part) => sum + part.length, 0));
  let start = 0;
  for (const part of parts) {
    joined.set(part, start);
    start += part.length;
  }
  return joined;
}
