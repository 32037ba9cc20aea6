/** The extent of the open stream, and its description. */

import type { StreamInfo } from "./protocol.js";

export class Extent {
  /** Null before the first frame or preview. */
  info: StreamInfo | null = null;
  #counted: number | null = null;
  #liveEdge: number | null = null;

  get firstFrame(): number {
    return this.info?.firstFrame ?? 0;
  }

  /** Ordinal after the last frame, once that has been decoded. */
  get counted(): number | null {
    return this.#counted;
  }

  /** Ordinal after the last frame, if known. */
  get end(): number | null {
    const count = this.info?.frameCount ?? null;
    return this.#counted ?? (count === null ? null : this.firstFrame + count);
  }

  /** Ordinal of the newest frame of a live stream; null if it is not live, or not yet known. */
  get liveEdge(): number | null {
    return this.#counted === null ? this.#liveEdge : null;
  }

  /** Duration of a frame at the speed of the capture, milliseconds. */
  get frameMs(): number {
    const { timescale = 30, frameTicks = 1 } = this.info ?? {};
    return (1000 * frameTicks) / timescale;
  }

  /** Note that the live stream has grown to a frame. */
  grow(frame: number): void {
    this.#liveEdge = frame;
  }

  /** Note that all frames have been decoded. */
  finish(frameCount: number): void {
    this.#counted = this.firstFrame + frameCount;
  }

  /** The frame of the stream nearest to an ordinal; may be Infinity if the end is unknown. */
  clamp(frame: number): number {
    const last = this.end === null ? Infinity : this.end - 1;
    return Math.max(this.firstFrame, Math.min(last, Math.round(frame)));
  }
}
