/** Figures of what is shown, in words for people. */

import type { FramePacket, StreamInfo } from "../protocol.js";

const WINDOW = 1000; // milliseconds in which frames are counted

export class Statistics {
  readonly #times: number[] = [];
  #packet: FramePacket | null = null;
  #sortMs = 0;

  /** Take note of a frame that is on the screen. */
  add(packet: FramePacket, sortMs: number): void {
    const now = performance.now();
    this.#times.push(now);
    while ((this.#times[0] ?? now) < now - WINDOW) this.#times.shift();
    this.#packet = packet;
    this.#sortMs = sortMs;
  }

  /** What there is to say, as names and values. */
  list(info: StreamInfo, buffered: number): readonly (readonly [string, string])[] {
    const packet = this.#packet;
    if (packet === null) return [];
    return [
      ["Gaussians", packet.count.toLocaleString("en")],
      ["changed", (packet.movedSlots.length || packet.codedSlots.length).toLocaleString("en")],
      ["frame", `${formatBytes(packet.bytes)}${packet.isCanonical ? ", canonical" : ""}`],
      ["decode", `${packet.decodeMs.toFixed(1)} ms`],
      ["sort", `${this.#sortMs.toFixed(1)} ms`],
      ["ahead", `${buffered} frame${buffered === 1 ? "" : "s"}`],
      ["shown", `${this.#times.length} of ${rateOf(info).toFixed(0)} per second`],
    ];
  }
}

/** Frames per second. */
export function rateOf({ timescale, frameTicks }: StreamInfo): number {
  return timescale / frameTicks;
}

/** A number of bytes; a KB is 1024 of them, as in all figures of quarc-ref. */
export function formatBytes(bytes: number): string {
  if (bytes < 1024) return `${bytes} bytes`;
  const kilobytes = bytes / 1024;
  return kilobytes < 1024 ? `${kilobytes.toFixed(1)} KB` : `${(kilobytes / 1024).toFixed(1)} MB`;
}

/** How far a stream of unknown or known length has come. */
export function describeLoading(bytes: number, byteLength: number | null): string {
  const all = byteLength === null ? "" : ` of ${formatBytes(byteLength)}`;
  return bytes === 0 ? "Loading" : `Loading ${formatBytes(bytes)}${all}`;
}
