/** The range of frames of the open stream, and the stream's description. */

import type { StreamInfo } from "./protocol.js";

export class Extent {
  /** Description of the stream; null before the first frame or preview. */
  info: StreamInfo | null = null;
  #decodedEnd: number | null = null;
  #liveEdge: number | null = null;

  get firstFrame(): number {
    return this.info?.firstFrame ?? 0;
  }

  /** Ordinal after the last frame; null until the last frame has been decoded. */
  get decodedEnd(): number | null {
    return this.#decodedEnd;
  }

  /** Ordinal after the last frame; null if unknown. */
  get endFrame(): number | null {
    const count = this.info?.frameCount ?? null;
    return this.#decodedEnd ?? (count === null ? null : this.firstFrame + count);
  }

  /** Ordinal of the newest frame of a live stream; null while unknown, and for a stream that is not live. */
  get liveEdge(): number | null {
    return this.#decodedEnd === null ? this.#liveEdge : null;
  }

  /** Duration of a frame at normal speed, milliseconds. */
  get frameMs(): number {
    const { timescale = 30, frameTicks = 1 } = this.info ?? {};
    return (1000 * frameTicks) / timescale;
  }

  /** Set the newest frame of a live stream. */
  grow(frame: number): void {
    this.#liveEdge = frame;
  }

  /** Set the number of frames, after all frames have been decoded. */
  finish(frameCount: number): void {
    this.#decodedEnd = this.firstFrame + frameCount;
  }

  /** The frame of the stream that is nearest to an ordinal; Infinity stays Infinity while the end is unknown. */
  clamp(frame: number): number {
    const lastFrame = this.endFrame === null ? Infinity : this.endFrame - 1;
    return Math.max(this.firstFrame, Math.min(lastFrame, Math.round(frame)));
  }
}
