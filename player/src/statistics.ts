/** Statistics of playback, for programs and for the statistics panel of the component. */

import type { FrameCost } from "./draw/stage.js";
import type { FramePacket, StreamInfo } from "./protocol.js";

const WINDOW_MS = 1000; // over which frames are counted

/** Statistics of the current frame and of playback so far. */
export interface Statistics {
  /** Number of Gaussians in the frame. */
  readonly gaussians: number;
  /** Number of Gaussians that the frame moved, or number whose codes it changed, whichever is larger. */
  readonly changed: number;
  /** Size of the frame in the stream, bytes; null if unknown, such as directly after a seek. */
  readonly frameBytes: number | null;
  readonly isCanonical: boolean;
  /** Times to decode, sort and upload the frame, milliseconds. */
  readonly decodeMs: number;
  readonly sortMs: number;
  readonly uploadMs: number;
  /** Number of decoded frames that are not shown yet. */
  readonly bufferedFrames: number;
  /** Number of frames shown in the last second. */
  readonly framesPerSecond: number;
  /** Number of frames of this stream that were not decoded when they were due. */
  readonly lateFrames: number;
  /** Number of frames from the current frame to the newest frame of a live stream; null if that is unknown. */
  readonly framesBehind: number | null;
  /** Number of bytes of this stream received so far. */
  readonly receivedBytes: number;
}

/** The statistics that playback provides. */
type PlaybackCounts = Pick<Statistics, "bufferedFrames" | "lateFrames" | "framesBehind">;

/** Records the shown frames, and computes the statistics. */
export class Recorder {
  receivedBytes = 0;
  readonly #shownTimes: number[] = [];
  #packet: FramePacket | null = null;
  #cost: FrameCost = { sortMs: 0, uploadMs: 0 };

  /** Record a frame that is on the screen. */
  add(packet: FramePacket, cost: FrameCost): void {
    this.#shownTimes.push(performance.now());
    this.#dropOldTimes();
    this.#packet = packet;
    this.#cost = cost;
  }

  /** The current statistics; null before the first frame. */
  read({ bufferedFrames, lateFrames, framesBehind }: PlaybackCounts): Statistics | null {
    this.#dropOldTimes();
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
      framesPerSecond: this.#shownTimes.length,
      lateFrames,
      framesBehind,
      receivedBytes: this.receivedBytes,
    };
  }

  #dropOldTimes(): void {
    const windowStart = performance.now() - WINDOW_MS;
    while ((this.#shownTimes[0] ?? windowStart) < windowStart) this.#shownTimes.shift();
  }
}

/** Frames per second of a stream at normal speed. */
export function frameRate({ timescale, frameTicks }: StreamInfo): number {
  return timescale / frameTicks;
}
