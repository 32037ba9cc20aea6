/** Decodes FRAM, from the state of the previous frame (SPEC 5.5, 7.4 to 7.6, 7.8). */

import { bindNewborn, sampleAndBind } from "./anchors.js";
import type { AnchorLevel } from "./anchors.js";
import { checkPosition } from "./attributes.js";
import { decodeNewborn } from "./births.js";
import { allIndices } from "./columns.js";
import { COUNTER_LIMIT, LOG_SCALE_PLANES } from "./constants.js";
import { Fields } from "./fields.js";
import type { Words } from "./fields.js";
import type { StreamHeader } from "./header.js";
import { decodeMotion } from "./motion.js";
import type { Rows } from "./motion.js";
import { Section } from "./planes.js";
import { demand } from "./reject.js";
import { rotate } from "./rotation.js";
import { appendScenes, selectGaussians } from "./scene.js";
import type { Scene } from "./scene.js";
import { checkCounts } from "./state.js";
import type { State } from "./state.js";
import { applyUpdates, decodeUpdates } from "./updates.js";

/** The row of the opacity codes (7.1). */
const OPACITY_ROW = LOG_SCALE_PLANES;

export interface FrameChunk {
  readonly phase: number;
  readonly usesPreviousContexts: boolean;
  readonly deathCount: number;
  readonly birthCount: number;
  readonly motion: Words;
  /** The section of updates; null in streams without updates. */
  readonly updates: Words | null;
  readonly births: Words;
  readonly stateCrc: number;
}

export function parseFrame(payload: Uint8Array, header: StreamHeader): FrameChunk {
  const fields = new Fields(payload);
  const chunk = {
    phase: fields.u32("phase"),
    usesPreviousContexts: fields.u8("previous_contexts", 0, 1) === 1,
    deathCount: fields.u32("death_count"),
    birthCount: fields.u32("birth_count"),
    motion: fields.words("motion"),
    updates: header.hasUpdates ? fields.words("updates") : null,
    births: fields.words("births"),
    stateCrc: fields.u32("state_crc"),
  };
  fields.finish();
  return chunk;
}

/** Decode a frame; return the next state. It shares the models of `previous`, which must not be used again. */
export function decodeFrame(chunk: FrameChunk, previous: State, header: StreamHeader): State {
  checkFrame(chunk, previous, header);
  const survivors = selectGaussians(previous.scene, findSurvivors(previous.scene.codes[OPACITY_ROW], chunk.deathCount));
  const isResampled = (chunk.phase - 1) % header.resampleInterval === 0;
  const [levels, boundScene] = isResampled
    ? sampleAndBind(survivors, chunk.phase, header)
    : [previous.levels, bindNewborn(survivors, previous.levels)];
  const movedScene = moveScene(boundScene, decodeSymbols(chunk, previous, levels, boundScene), header);
  const updatedScene = chunk.updates === null ? movedScene : updateScene(chunk.updates, previous, movedScene, header);
  checkCounts(updatedScene.ids.length + chunk.birthCount, chunk.birthCount, header);
  const births = new Section(chunk.births);
  const newborn = decodeNewborn(births, previous.birthModels, updatedScene, header, chunk.birthCount, previous.nextId);
  births.finish();
  return {
    ...previous,
    ordinal: previous.ordinal + 1,
    phase: chunk.phase,
    scene: appendScenes(updatedScene, newborn),
    levels,
    nextId: previous.nextId + chunk.birthCount,
  };
}

/**
 * Check the chunk against the previous state. With updates, the number of deleted Gaussians is not known yet, except that
 * at least one Gaussian must survive.
 */
function checkFrame(chunk: FrameChunk, previous: State, header: StreamHeader): void {
  const count = previous.scene.ids.length;
  demand(chunk.phase === previous.phase + 1, "frame-order", `phase ${chunk.phase} follows phase ${previous.phase}`);
  demand(previous.ordinal < COUNTER_LIMIT, "frame-order", "the ordinal of a frame is above 2^32 - 1");
  demand(chunk.deathCount < count, "count", `${chunk.deathCount} deaths of ${count} Gaussians`);
  const minSurvivors = chunk.updates === null ? count - chunk.deathCount : 1;
  checkCounts(minSurvivors + chunk.birthCount, chunk.birthCount, header);
  demand(
    previous.nextId + chunk.birthCount - 1 <= COUNTER_LIMIT,
    "count-exceeds-level",
    "the ids of new Gaussians exceed 2^32 - 1",
  );
}

/** Return the indices of all Gaussians except the `count` with the lowest (opacity code, id), ascending. */
export function findSurvivors(opacity: Int32Array, count: number): Uint32Array {
  const order = allIndices(opacity.length).sort((i, j) => opacity[i] - opacity[j] || i - j);
  return order.subarray(count).sort();
}

function decodeSymbols(chunk: FrameChunk, previous: State, levels: readonly AnchorLevel[], scene: Scene): Rows[] {
  const section = new Section(chunk.motion);
  const symbols = decodeMotion(section, previous.motionModels, levels, scene, chunk.usesPreviousContexts);
  section.finish();
  return symbols;
}

/** Move every Gaussian by the symbols of the anchors to which it is bound (7.5). */
function moveScene(scene: Scene, symbols: readonly Rows[], header: StreamHeader): Scene {
  const motion = scene.motion.map((row, channel) =>
    row.map((_, i) => symbols.reduce((sum, rows, level) => sum + rows[channel][scene.binding[level][i]], 0)),
  );
  const positions = scene.positions.map((column, axis) =>
    column.map((coordinate, i) => checkPosition(coordinate + header.translationStep * motion[axis][i])),
  );
  return { ...scene, motion, positions, rotations: rotateScene(scene, motion, header) };
}

/** Decode and apply the updates of individual Gaussians (7.8). */
function updateScene(words: Words, previous: State, movedScene: Scene, header: StreamHeader): Scene {
  const section = new Section(words);
  const updates = decodeUpdates(section, previous.updateModels, movedScene);
  section.finish();
  return applyUpdates(updates, movedScene, header);
}

function rotateScene(scene: Scene, motion: readonly Int32Array[], header: StreamHeader): Int32Array[] {
  const [w, x, y, z] = scene.rotations.map((column) => column.slice());
  const [mx, my, mz] = motion.slice(-3);
  const mw = header.rotationComponents === 4 ? motion[3] : new Int32Array(mx.length);
  const identity = header.levelCount * header.rotationUnity;
  for (let i = 0; i < w.length; i++) {
    if (mw[i] === 0 && mx[i] === 0 && my[i] === 0 && mz[i] === 0) continue;
    const residual = [identity + mw[i], mx[i], my[i], mz[i]] as const;
    [w[i], x[i], y[i], z[i]] = rotate([w[i], x[i], y[i], z[i]], residual);
  }
  return [w, x, y, z];
}
