/** Figures of playback, for programs and for the panel of the component. */

import type { FrameCost } from "./draw/stage.js";
import type { FramePacket, StreamInfo } from "./protocol.js";

const WINDOW_MS = 1000; // over which frames are counted

/** Figures of the current frame and of playback so far. Times are in milliseconds. */
export interface Statistics {
  readonly gaussians: number;
  /** Gaussians that the frame moved or recoded. */
  readonly changed: number;
  /** Size of the frame in the stream; null if unknown, as right after a seek. */
  readonly frameBytes: number | null;
  readonly isCanonical: boolean;
  readonly decodeMs: number;
  readonly sortMs: number;
  readonly uploadMs: number;
  /** Number of decoded frames that are not shown yet. */
  readonly bufferedFrames: number;
  /** Frames shown in the last second. */
  readonly framesPerSecond: number;
  /** Number of frames that were not decoded when they were due. */
  readonly lateFrames: number;
  /** Frames from the current one to the newest of a live stream; null if there is none. */
  readonly framesBehind: number | null;
  readonly receivedBytes: number;
}

/** The figures that playback counts. */
type PlaybackCounts = Pick<Statistics, "bufferedFrames" | "lateFrames" | "framesBehind">;

/** Counts the frames on the screen. */
export class Recorder {
  receivedBytes = 0;
  readonly #times: number[] = [];
  #packet: FramePacket | null = null;
  #cost: FrameCost = { sortMs: 0, uploadMs: 0 };

  /** Count a frame that is on the screen. */
  add(packet: FramePacket, cost: FrameCost): void {
    this.#times.push(performance.now());
    this.#forget();
    this.#packet = packet;
    this.#cost = cost;
  }

  /** The figures; null before the first frame. */
  read({ bufferedFrames, lateFrames, framesBehind }: PlaybackCounts): Statistics | null {
    this.#forget();
    const packet = this.#packet;
    if (packet === null) return null;
    return {
      gaussians: packet.count,
      changed: Math.max(packet.movedSlots.length, packet.codedSlots.length),
      frameBytes: packet.bytes,
      isCanonical: packet.isCanonical,
      decodeMs: packet.decodeMs,
      ...this.#cost,
      bufferedFrames,
      framesPerSecond: this.#times.length,
      lateFrames,
      framesBehind,
      receivedBytes: this.receivedBytes,
    };
  }

  #forget(): void {
    const since = performance.now() - WINDOW_MS;
    while ((this.#times[0] ?? since) < since) this.#times.shift();
  }
}

/** Frames per second of a stream. */
export function rateOf({ timescale, frameTicks }: StreamInfo): number {
  return timescale / frameTicks;
}
