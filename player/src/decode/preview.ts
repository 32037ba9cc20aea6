/** Previews while loading: packets of a canonical frame whose sections have not all arrived. */

import type { FramePacket, StreamInfo } from "../protocol.js";
import type { FrameState } from "./quarc.js";

/** Positions and colors, the first two sections (SPEC 8.5), suffice for a preview. */
export const MIN_PREVIEW_SECTIONS = 2;
const SECTIONS_WITH_OPACITY = 3;
const SECTIONS_WITH_LOG_SCALES = 4;
const SECTIONS_WITH_ROTATIONS = 5;
const NEIGHBORS_PER_SIDE = 3; // before and after a Gaussian, in the order of the state
const DEVIATION_PER_DISTANCE = 0.5; // guessed standard deviation / distance to the nearest neighbor
const MAX_RELATIVE_LOG_SIZE = Math.log(6); // relative to the median of the guessed sizes
const MAX_RELATIVE_LOG_SIZE_BEFORE_OPACITY = Math.log(2); // smaller, because large Gaussians might hide everything
const MEDIAN_OPACITY_LOGIT = 2; // guess for Gaussians of median size: an opacity of 0.88
const LOGIT_PER_LOG_SIZE = 6; // decrease of the guessed opacity logit for larger Gaussians
const MIN_OPACITY_LOGIT = -6;
const OPACITY_ROW = 3; // index of opacity among the codes of a Gaussian
const CODES_BEFORE_SH_REST = 7;

/** Positions, and sizes guessed from their distances: logarithms of standard deviations in lattice units. */
interface SizeEstimate {
  readonly positions: Int32Array;
  readonly logSizes: Float32Array;
  readonly median: number;
}

type QuantizationSteps = Pick<StreamInfo, "logScaleStep" | "opacityStep" | "latticeExponent">;

/** The previews of one canonical frame. */
export class Preview {
  #estimate: SizeEstimate | null = null;

  /** Guess sizes from the positions, once; this can be done while the colors are still arriving. */
  estimateSizes({ count, positions }: FrameState): SizeEstimate {
    return (this.#estimate ??= guessSizes(interleave(new Int32Array(3 * count), positions)));
  }

  /** Make a packet from the sections that have arrived; the caller sets `run` and `decodeMs`. */
  makePacket(state: FrameState, sections: number, steps: QuantizationSteps): Omit<FramePacket, "run" | "decodeMs"> {
    const { frame, count, rotations } = state;
    const slots = new Uint32Array(count).map((_, slot) => slot);
    return {
      ...{ frame, isFull: true, isPreview: true, count, slotLimit: count },
      ...{ movedSlots: slots, positions: this.estimateSizes(state).positions.slice() },
      rotations: interleave(new Int32Array(4 * count), rotations),
      ...{ codedSlots: slots.slice(), codes: this.#fillCodes(state, sections, steps) },
      ...{ freedSlots: new Uint32Array(0), bornSlots: new Uint32Array(0), bytes: null, isCanonical: true },
    };
  }

  #fillCodes(state: FrameState, sections: number, steps: QuantizationSteps): Int16Array {
    const { count, codes } = state;
    const width = codes.length;
    const shownColumns = [...codes.keys()].filter((column) => column < CODES_BEFORE_SH_REST);
    const knownColumns = shownColumns.filter((column) => sections >= requiredSections(column));
    const packedCodes = interleave(new Int16Array(width * count), codes, knownColumns);
    if (sections < SECTIONS_WITH_OPACITY) {
      const { logSizes, median } = this.estimateSizes(state);
      for (let index = 0, codeIndex = OPACITY_ROW; index < count; index++, codeIndex += width) {
        const logit = MEDIAN_OPACITY_LOGIT - LOGIT_PER_LOG_SIZE * Math.max(0, logSizes[index]! - median);
        packedCodes[codeIndex] = Math.round(Math.max(MIN_OPACITY_LOGIT, logit) / steps.opacityStep);
      }
    }
    if (sections < SECTIONS_WITH_LOG_SCALES) {
      const logLatticeUnit = -Math.LN2 * steps.latticeExponent;
      const { logSizes, median } = this.estimateSizes(state);
      const hasOpacity = sections >= SECTIONS_WITH_OPACITY;
      const maxLogSize = median + (hasOpacity ? MAX_RELATIVE_LOG_SIZE : MAX_RELATIVE_LOG_SIZE_BEFORE_OPACITY);
      for (let index = 0, codeIndex = 0; index < count; index++, codeIndex += width) {
        const code = Math.round((Math.min(logSizes[index]!, maxLogSize) + logLatticeUnit) / steps.logScaleStep);
        packedCodes[codeIndex] = packedCodes[codeIndex + 1] = packedCodes[codeIndex + 2] = code;
      }
    } else if (sections < SECTIONS_WITH_ROTATIONS) makeSpherical(packedCodes, width);
    return packedCodes;
  }
}

/** Number of sections that must have arrived before a column of codes is known. */
function requiredSections(column: number): number {
  if (column < OPACITY_ROW) return SECTIONS_WITH_LOG_SCALES;
  return column === OPACITY_ROW ? SECTIONS_WITH_OPACITY : MIN_PREVIEW_SECTIONS;
}

/** Guess the sizes of Gaussians from the distances to their neighbors. */
function guessSizes(positions: Int32Array): SizeEstimate {
  const count = positions.length / 3;
  const logSizes = new Float32Array(count);
  for (let index = 0; index < count; index++) {
    let minSquaredDistance = Infinity;
    const lastNeighbor = Math.min(count - 1, index + NEIGHBORS_PER_SIDE);
    for (let neighbor = Math.max(0, index - NEIGHBORS_PER_SIDE); neighbor <= lastNeighbor; neighbor++) {
      const x = positions[3 * neighbor]! - positions[3 * index]!;
      const y = positions[3 * neighbor + 1]! - positions[3 * index + 1]!;
      const z = positions[3 * neighbor + 2]! - positions[3 * index + 2]!;
      const squaredDistance = x * x + y * y + z * z;
      if (squaredDistance > 0 && squaredDistance < minSquaredDistance) minSquaredDistance = squaredDistance;
    }
    logSizes[index] = Math.log(DEVIATION_PER_DISTANCE) + Math.log(minSquaredDistance) / 2;
  }
  const median = logSizes.slice().sort()[count >> 1] ?? 0;
  return { positions, logSizes, median: Number.isFinite(median) ? median : 0 };
}

/** Make every Gaussian a sphere, because rotations are not known yet. */
function makeSpherical(codes: Int16Array, width: number): void {
  for (let start = 0; start < codes.length; start += width) {
    codes.fill(Math.round((codes[start]! + codes[start + 1]! + codes[start + 2]!) / 3), start, start + 3);
  }
}

/** Write planes to the columns of a row-major array; unlisted columns stay 0. */
function interleave<T extends Int32Array | Int16Array>(
  rows: T,
  planes: readonly T[],
  columns: readonly number[] = [...planes.keys()],
): T {
  for (const column of columns) {
    const plane = planes[column]!;
    for (let index = 0; planes.length * index + column < rows.length; index++) {
      rows[planes.length * index + column] = plane[index]!;
    }
  }
  return rows;
}
