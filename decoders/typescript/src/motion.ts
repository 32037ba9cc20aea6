/**
 * Decodes the symbols of the anchors (SPEC 8.7), from the coarsest level to the finest level.
 */

import type { AnchorLevel } from "./anchors.js";
import { allIndices, indicesWhere, pickColumn, tabulate } from "./columns.js";
import { MAGNITUDE_PLANES } from "./constants.js";
import * as contexts from "./motion-contexts.js";
import { Model } from "./planes.js";
import type { Section } from "./planes.js";
import { findId } from "./scene.js";
import type { Scene } from "./scene.js";

/** One row per channel, with a number for every anchor of a level. */
export type Rows = readonly Int32Array[];

/** The models of a level; their counts persist from frame to frame. */
export class MotionModels {
  readonly moves = new Model(contexts.MOVES_CONTEXTS);
  readonly translationNotZero = new Model(contexts.NOT_ZERO_CONTEXTS);
  readonly wNotZero = new Model(contexts.NOT_ZERO_CONTEXTS);
  readonly rotationNotZero = new Model(contexts.NOT_ZERO_CONTEXTS);
  readonly sign = new Model(contexts.SIGN_CONTEXTS);
  readonly magnitude = new Model(contexts.MAGNITUDE_CONTEXTS);

  /** Return the model of "not 0" for each of 6 or 7 channels. */
  notZero(channelCount: number): Model[] {
    const { translationNotZero: t, wNotZero: w, rotationNotZero: r } = this;
    return channelCount === 6 ? [t, t, t, r, r, r] : [t, t, t, w, r, r, r];
  }
}

/**
 * Decode the symbols of all levels; return them beginning with level 1.
 *
 * @param scene the scene before the motion; its `motion` is that of the previous frame
 */
export function decodeMotion(
  section: Section,
  models: readonly MotionModels[],
  levels: readonly AnchorLevel[],
  scene: Scene,
  previousContexts: boolean,
): Rows[] {
  const symbols: Rows[] = [];
  let coarserLevel = null;
  for (let level = levels.length - 1; level >= 0; level--) {
    const anchors = levels[level];
    const parentSymbols: Rows = gatherParentRows(anchors, coarserLevel?.symbols, scene.motion.length);
    const accumulated = addRows(gatherParentRows(anchors, coarserLevel?.done, scene.motion.length), parentSymbols);
    const ownRows = previousContexts
      ? findOwnMotion(anchors, scene)
      : zeroRows(anchors.ids.length, scene.motion.length);
    const expected = ownRows.map((row, channel) => row.map((motion, a) => motion - accumulated[channel][a]));
    symbols[level] = decodeLevel(section, models[level], expected, sumMagnitudes(parentSymbols));
    coarserLevel = { symbols: symbols[level], done: accumulated };
  }
  return symbols;
}

/** Return the motion of the anchors' own Gaussians in the previous frame; 0 for deleted Gaussians. */
function findOwnMotion(anchors: AnchorLevel, scene: Scene): Rows {
  const indices = tabulate(anchors.ids.length, (anchor) => findId(scene.ids, anchors.ids[anchor]));
  return scene.motion.map((row) => indices.map((i) => (i < 0 ? 0 : row[i])));
}

function decodeLevel(section: Section, models: MotionModels, expected: Rows, parentSums: Int32Array): Rows {
  const count = parentSums.length;
  const expectedSums = sumMagnitudes(expected);
  const moves = section.decodePlane(
    models.moves,
    parentSums.map((sum, anchor) => contexts.movesContext(sum, expectedSums[anchor])),
  );
  const movingAnchors = indicesWhere(count, (anchor) => moves[anchor] === 1);
  const symbolIndices = decodeNotZero(section, models, expected, movingAnchors);
  const expectedSymbols = tabulate(
    symbolIndices.length,
    (i) => expected[Math.floor(symbolIndices[i] / count)][symbolIndices[i] % count],
  );
  const rows = zeroRows(count, expected.length);
  decodeSymbols(section, models, expectedSymbols).forEach((symbol, i) => {
    rows[Math.floor(symbolIndices[i] / count)][symbolIndices[i] % count] = symbol;
  });
  return rows;
}

/** Decode which symbols are nonzero; return their indices (channel x number of anchors + anchor), ascending. */
function decodeNotZero(
  section: Section,
  models: MotionModels,
  expected: Rows,
  movingAnchors: Uint32Array,
): Uint32Array {
  const nonzeroCounts = new Uint8Array(movingAnchors.length);
  const symbolIndices = models.notZero(expected.length).map((model, channel) => {
    const row = expected[channel];
    const notZeroContexts = pickColumn(row, movingAnchors).map((expectedSymbol, i) =>
      contexts.notZeroContext(expectedSymbol, nonzeroCounts[i]),
    );
    const bits = section.decodePlane(model, notZeroContexts);
    bits.forEach((bit, i) => {
      nonzeroCounts[i] += bit;
    });
    return movingAnchors.filter((_, i) => bits[i] === 1).map((anchor) => channel * row.length + anchor);
  });
  return joinArrays(symbolIndices);
}

/** Decode nonzero symbols, first signs, then magnitudes; `expected` contains the expected symbols. */
function decodeSymbols(section: Section, models: MotionModels, expected: Int32Array): Int32Array {
  const isNegative = section.decodePlane(models.sign, expected.map(contexts.signContext));
  const signedExpected = expected.map((expectedSymbol, i) => (isNegative[i] ? -expectedSymbol : expectedSymbol));
  const symbols = new Int32Array(expected.length).fill(1);
  let codedIndices = allIndices(expected.length);
  for (let plane = 0; plane < MAGNITUDE_PLANES && codedIndices.length > 0; plane++) {
    const magnitudeContexts = pickColumn(signedExpected, codedIndices).map((expectedSymbol) =>
      contexts.magnitudeContext(plane, expectedSymbol),
    );
    const isAbove = section.decodePlane(models.magnitude, magnitudeContexts);
    codedIndices = codedIndices.filter((_, index) => isAbove[index] === 1);
    for (const i of codedIndices) symbols[i] += 1;
  }
  return symbols.map((magnitude, i) => (isNegative[i] ? -magnitude : magnitude));
}

/** Return the numbers of every anchor's parent; 0 if there is no coarser level. */
function gatherParentRows(anchors: AnchorLevel, coarserLevel: Rows | undefined, channelCount: number): Rows {
  if (coarserLevel === undefined) return zeroRows(anchors.ids.length, channelCount);
  return coarserLevel.map((row) => anchors.parents.map((parent) => row[parent]));
}

function addRows(first: Rows, second: Rows): Rows {
  return first.map((row, channel) => row.map((number, anchor) => number + second[channel][anchor]));
}

/** Return the sum of magnitudes over all rows, for every column. */
export function sumMagnitudes(rows: Rows): Int32Array {
  return rows[0].map((_, anchor) => rows.reduce((sum, row) => sum + Math.abs(row[anchor]), 0));
}

function zeroRows(count: number, channelCount: number): Rows {
  return Array.from({ length: channelCount }, () => new Int32Array(count));
}

function joinArrays(parts: readonly Uint32Array[]): Uint32Array {
  const result = new Uint32Array(parts.reduce((sum, part) => sum + part.length, 0));
  let start = 0;
  for (const part of parts) {
    result.set(part, start);
    start += part.length;
  }
  return result;
}
