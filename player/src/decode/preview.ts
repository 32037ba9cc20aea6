/** A picture while loading: a packet of a canonical frame of which not all sections have arrived. */

import type { FramePacket, StreamInfo } from "../protocol.js";
import type { State } from "./quarc.js";

/** Positions come first, then colors (SPEC 8.5); with them there is something to see. */
export const SECTIONS_TO_SHOW = 2;
const SECTIONS_TO_OPACITY = 3;
const SECTIONS_TO_LOG_SCALES = 4;
const SECTIONS_TO_ROTATIONS = 5;
const NEIGHBORS = 3; // before and after, in the order of the positions
const SPREAD = 0.55; // of the distance to the nearest of them: a standard deviation
const LARGEST = 6; // times the median guess
const OPACITY_LOGIT = 2; // of Gaussians whose opacity has not arrived: 0.88
const OPACITY_CODE = 3; // its place among the codes of a Gaussian

/** The packet of a preview, complete but for its run and its time. */
export function makePreview(
  state: State,
  sections: number,
  steps: Pick<StreamInfo, "logScaleStep" | "opacityStep" | "latticeExponent">,
): Omit<FramePacket, "run" | "decodeMs"> {
  const { frame, count, codes } = state;
  const slots = new Uint32Array(count).map((_, slot) => slot);
  const positions = interleave(Int32Array, state.positions);
  const packed = interleave(Int16Array, codes);
  if (sections < SECTIONS_TO_OPACITY) {
    const code = Math.round(OPACITY_LOGIT / steps.opacityStep);
    for (let at = OPACITY_CODE; at < packed.length; at += codes.length) packed[at] = code;
  }
  if (sections < SECTIONS_TO_LOG_SCALES) {
    const unit = -Math.LN2 * steps.latticeExponent;
    const guesses = guessLogSizes(positions).map((size) => Math.round((size + unit) / steps.logScaleStep));
    for (let index = 0; index < count; index++) {
      packed.fill(guesses[index]!, codes.length * index, codes.length * index + 3);
    }
  } else if (sections < SECTIONS_TO_ROTATIONS) makeRound(packed, codes.length);
  return {
    ...{ frame, isFull: true, isPreview: true, count, slotLimit: count },
    ...{ movedSlots: slots, positions, rotations: interleave(Int32Array, state.rotations) },
    ...{ codedSlots: slots.slice(), codes: packed, freedSlots: new Uint32Array(0) },
    ...{ bytes: null, isCanonical: true },
  };
}

/** Natural logarithms of standard deviations, lattice units, by how near the neighbors are. */
function guessLogSizes(positions: Int32Array): Float32Array {
  const count = positions.length / 3;
  const sizes = new Float32Array(count);
  for (let index = 0; index < count; index++) {
    let nearest = Infinity;
    const last = Math.min(count - 1, index + NEIGHBORS);
    for (let other = Math.max(0, index - NEIGHBORS); other <= last; other++) {
      const x = positions[3 * other]! - positions[3 * index]!;
      const y = positions[3 * other + 1]! - positions[3 * index + 1]!;
      const z = positions[3 * other + 2]! - positions[3 * index + 2]!;
      const square = x * x + y * y + z * z;
      if (square > 0 && square < nearest) nearest = square;
    }
    sizes[index] = SPREAD * Math.sqrt(nearest);
  }
  const median = sizes.slice().sort()[count >> 1] ?? 1;
  return sizes.map((size) => Math.log(Math.min(size, LARGEST * median)));
}

/** Give every Gaussian one size: how it is turned is not known yet. */
function makeRound(codes: Int16Array, width: number): void {
  for (let at = 0; at < codes.length; at += width) {
    codes.fill(Math.round((codes[at]! + codes[at + 1]! + codes[at + 2]!) / 3), at, at + 3);
  }
}

/** Planes to rows. */
function interleave<T extends Int32Array | Int16Array>(
  type: new (length: number) => T,
  planes: readonly T[],
): T {
  const count = planes[0]?.length ?? 0;
  const rows = new type(planes.length * count);
  planes.forEach((plane, column) => {
    for (let index = 0, at = column; index < count; index++, at += planes.length) rows[at] = plane[index]!;
  });
  return rows;
}
