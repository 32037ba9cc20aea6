/** FRAM: decodes a frame from the state of the previous one (SPEC 5.5, 7.4 to 7.6, 7.8). */

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
import { turn } from "./rotation.js";
import { append, select } from "./scene.js";
import type { Scene } from "./scene.js";
import { checkCounts } from "./state.js";
import type { State } from "./state.js";
import { applyUpdates, decodeUpdates } from "./updates.js";

/** The row of the opacity codes (7.1). */
const OPACITY_ROW = LOG_SCALE_PLANES;

export interface FrameChunk {
  readonly phase: number;
  readonly previousContexts: boolean;
  readonly deathCount: number;
  readonly birthCount: number;
  readonly motion: Words;
  /** Null in streams without updates, which do not have this section. */
  readonly updates: Words | null;
  readonly births: Words;
  readonly stateCrc: number;
}

export function parseFrame(payload: Uint8Array, header: StreamHeader): FrameChunk {
  const fields = new Fields(payload);
  const chunk = {
    phase: fields.u32("phase"),
    previousContexts: fields.u8("previous_contexts", 0, 1) === 1,
    deathCount: fields.u32("death_count"),
    birthCount: fields.u32("birth_count"),
    motion: fields.section("motion"),
    updates: header.updates ? fields.section("updates") : null,
    births: fields.section("births"),
    stateCrc: fields.u32("state_crc"),
  };
  fields.end();
  return chunk;
}

/** Return the next state. It takes over the counts of `before`, so that `before` must not be used again. */
export function decodeFrame(chunk: FrameChunk, before: State, header: StreamHeader): State {
  checkFrame(chunk, before, header);
  const survivors = select(before.scene, findSurvivors(before.scene.codes[OPACITY_ROW], chunk.deathCount));
  const samples = (chunk.phase - 1) % header.resampleInterval === 0;
  const [levels, bound] = samples
    ? sampleAndBind(survivors, chunk.phase, header)
    : [before.levels, bindNewborn(survivors, before.levels)];
  const moved = moveScene(bound, decodeSymbols(chunk, before, levels, bound), header);
  const updated = chunk.updates === null ? moved : updateScene(chunk.updates, before, moved, header);
  checkCounts(updated.ids.length + chunk.birthCount, chunk.birthCount, header);
  const births = new Section(chunk.births);
  const newborn = decodeNewborn(births, before.birthModels, updated, header, chunk.birthCount, before.nextId);
  births.finish();
  return {
    ...before,
    ordinal: before.ordinal + 1,
    phase: chunk.phase,
    scene: append(updated, newborn),
    levels,
    nextId: before.nextId + chunk.birthCount,
  };
}

/**
 * Check the chunk against the previous state. How many Gaussians updates delete is not known yet: at least one must
 * stay.
 */
function checkFrame(chunk: FrameChunk, before: State, header: StreamHeader): void {
  const count = before.scene.ids.length;
  demand(chunk.phase === before.phase + 1, "frame-order", `phase ${chunk.phase} follows ${before.phase}`);
  demand(before.ordinal < COUNTER_LIMIT, "frame-order", "the ordinal of a frame is above 2^32 - 1");
  demand(chunk.deathCount < count, "count", `${chunk.deathCount} deaths of ${count} Gaussians`);
  const staying = chunk.updates === null ? count - chunk.deathCount : 1;
  checkCounts(staying + chunk.birthCount, chunk.birthCount, header);
  demand(before.nextId + chunk.birthCount - 1 <= COUNTER_LIMIT, "count-exceeds-level", "the ids are used up");
}

/** All indices except those of the `count` Gaussians with the lowest (opacity code, id), ascending. */
export function findSurvivors(opacity: Int32Array, count: number): Uint32Array {
  const order = allIndices(opacity.length).sort((i, j) => opacity[i] - opacity[j] || i - j);
  return order.subarray(count).sort();
}

function decodeSymbols(chunk: FrameChunk, before: State, levels: readonly AnchorLevel[], scene: Scene): Rows[] {
  const section = new Section(chunk.motion);
  const symbols = decodeMotion(section, before.motionModels, levels, scene, chunk.previousContexts);
  section.finish();
  return symbols;
}

/** Move the scene by the symbols of the anchors that its Gaussians follow (7.5). */
function moveScene(scene: Scene, symbols: readonly Rows[], header: StreamHeader): Scene {
  const motion = scene.motion.map((row, channel) =>
    row.map((_, i) => symbols.reduce((sum, rows, level) => sum + rows[channel][scene.binding[level][i]], 0)),
  );
  const positions = scene.positions.map((column, axis) =>
    column.map((coordinate, i) => checkPosition(coordinate + header.translationStep * motion[axis][i])),
  );
  return { ...scene, motion, positions, rotations: turnAll(scene, motion, header) };
}

/** Apply the updates of single Gaussians (7.8). */
function updateScene(words: Words, before: State, moved: Scene, header: StreamHeader): Scene {
  const section = new Section(words);
  const updates = decodeUpdates(section, before.updateModels, moved);
  section.finish();
  return applyUpdates(updates, moved, header);
}

function turnAll(scene: Scene, motion: readonly Int32Array[], header: StreamHeader): Int32Array[] {
  const [w, x, y, z] = scene.rotations.map((column) => column.slice());
  const [mx, my, mz] = motion.slice(-3);
  const mw = header.rotationComponents === 4 ? motion[3] : new Int32Array(mx.length);
  const identity = header.levelCount * header.rotationUnity;
  for (let i = 0; i < w.length; i++) {
    if (mw[i] === 0 && mx[i] === 0 && my[i] === 0 && mz[i] === 0) continue;
    const residual = [identity + mw[i], mx[i], my[i], mz[i]] as const;
    [w[i], x[i], y[i], z[i]] = turn([w[i], x[i], y[i], z[i]], residual);
  }
  return [w, x, y, z];
}
