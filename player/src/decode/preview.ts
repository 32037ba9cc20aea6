/** A picture while loading: a packet of a canonical frame whose sections have not all arrived. */

import type { FramePacket, StreamInfo } from "../protocol.js";
import type { State } from "./quarc.js";

/** Positions come first, then colors (SPEC 8.5); with both, a picture makes sense. */
export const SECTIONS_TO_SHOW = 2;
const SECTIONS_TO_OPACITY = 3;
const SECTIONS_TO_LOG_SCALES = 4;
const SECTIONS_TO_ROTATIONS = 5;
const NEIGHBORS = 3; // before and after, in the order of the positions
const SPREAD = 0.5; // of the distance to the nearest of them: a standard deviation
const LARGEST = Math.log(6); // upper limit, relative to the median guess
const LARGEST_BEFORE_OPACITY = Math.log(2); // smaller, because large Gaussians might hide everything
const OPACITY_LOGIT = 2; // of Gaussians of median size whose opacity has not arrived: an opacity of 0.88
const FADING = 6; // by which it is lower for a size that is e times as large
const LEAST_LOGIT = -6;
const OPACITY_CODE = 3; // its row among the codes of a Gaussian
const PLAIN_CODES = 7; // before those of SH rest

/** Positions, and the sizes guessed from them: logarithms of standard deviations, lattice units. */
interface Places {
  readonly positions: Int32Array;
  readonly logSizes: Float32Array;
  readonly median: number;
}

type Steps = Pick<StreamInfo, "logScaleStep" | "opacityStep" | "latticeExponent">;

/** The previews of one canonical frame. */
export class Preview {
  #known: Places | null = null;

  /** Take the positions, and guess sizes, while the colors are still arriving. */
  prepare({ count, positions }: State): Places {
    return (this.#known ??= measurePlaces(interleave(new Int32Array(3 * count), positions)));
  }

  /** The packet of what is known; run and time are set by the caller. */
  make(state: State, sections: number, steps: Steps): Omit<FramePacket, "run" | "decodeMs"> {
    const { frame, count, rotations } = state;
    const slots = new Uint32Array(count).map((_, slot) => slot);
    return {
      ...{ frame, isFull: true, isPreview: true, count, slotLimit: count },
      ...{ movedSlots: slots, positions: this.prepare(state).positions.slice() },
      rotations: interleave(new Int32Array(4 * count), rotations),
      ...{ codedSlots: slots.slice(), codes: this.#fillCodes(state, sections, steps) },
      ...{ freedSlots: new Uint32Array(0), bytes: null, isCanonical: true },
    };
  }

  #fillCodes(state: State, sections: number, steps: Steps): Int16Array {
    const { count, codes } = state;
    const width = codes.length;
    const known = [...codes.keys()].filter((column) => column < PLAIN_CODES && sections >= sectionsTo(column));
    const packed = interleave(new Int16Array(width * count), codes, known);
    if (sections < SECTIONS_TO_OPACITY) {
      const { logSizes, median } = this.prepare(state);
      for (let index = 0, at = OPACITY_CODE; index < count; index++, at += width) {
        const logit = OPACITY_LOGIT - FADING * Math.max(0, logSizes[index]! - median);
        packed[at] = Math.round(Math.max(LEAST_LOGIT, logit) / steps.opacityStep);
      }
    }
    if (sections < SECTIONS_TO_LOG_SCALES) {
      const unit = -Math.LN2 * steps.latticeExponent;
      const { logSizes, median } = this.prepare(state);
      const most = median + (sections < SECTIONS_TO_OPACITY ? LARGEST_BEFORE_OPACITY : LARGEST);
      for (let index = 0, at = 0; index < count; index++, at += width) {
        const code = Math.round((Math.min(logSizes[index]!, most) + unit) / steps.logScaleStep);
        packed[at] = packed[at + 1] = packed[at + 2] = code;
      }
    } else if (sections < SECTIONS_TO_ROTATIONS) makeRound(packed, width);
    return packed;
  }
}

/** Number of sections after which a column of codes is known. */
function sectionsTo(column: number): number {
  if (column < OPACITY_CODE) return SECTIONS_TO_LOG_SCALES;
  return column === OPACITY_CODE ? SECTIONS_TO_OPACITY : SECTIONS_TO_SHOW;
}

/** Guess sizes from the distances to neighbors. */
function measurePlaces(positions: Int32Array): Places {
  const count = positions.length / 3;
  const logSizes = new Float32Array(count);
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
    logSizes[index] = Math.log(SPREAD) + Math.log(nearest) / 2;
  }
  const median = logSizes.slice().sort()[count >> 1] ?? 0;
  return { positions, logSizes, median: Number.isFinite(median) ? median : 0 };
}

/** Make every Gaussian a sphere, because rotations are not known yet. */
function makeRound(codes: Int16Array, width: number): void {
  for (let at = 0; at < codes.length; at += width) {
    codes.fill(Math.round((codes[at]! + codes[at + 1]! + codes[at + 2]!) / 3), at, at + 3);
  }
}

/** Convert the given planes to rows. */
function interleave<T extends Int32Array | Int16Array>(
  rows: T,
  planes: readonly T[],
  columns: readonly number[] = [...planes.keys()],
): T {
  for (const column of columns) {
    const plane = planes[column]!;
    for (let index = 0, at = column; at < rows.length; index++, at += planes.length) rows[at] = plane[index]!;
  }
  return rows;
}
