/** Formats statistics as text. */

import type { StreamInfo } from "../protocol.js";
import { frameRate, type Statistics } from "../statistics.js";

/** Format a number of bytes; a KB is 1024 bytes, as everywhere in quarc-ref. */
export function formatBytes(bytes: number | null): string {
  if (bytes === null) return "size unknown";
  if (bytes < 1024) return `${bytes} bytes`;
  const kilobytes = bytes / 1024;
  return kilobytes < 1024 ? `${kilobytes.toFixed(1)} KB` : `${(kilobytes / 1024).toFixed(1)} MB`;
}

/** Describe how much of a stream has been received. */
export function describeLoaded(bytes: number, byteLength: number | null): string {
  const total = byteLength === null ? "" : ` of ${formatBytes(byteLength)}`;
  return bytes === 0 ? "" : `${formatBytes(bytes)}${total}`;
}

/** List the rows of the statistics panel: names and values. */
export function listStatistics(
  statistics: Statistics,
  info: StreamInfo,
): readonly (readonly [string, string])[] {
  const { gaussians, changed, frameBytes, isCanonical, decodeMs, sortMs, uploadMs } = statistics;
  const { bufferedFrames, framesPerSecond, lateFrames, framesBehind } = statistics;
  const formatFrames = (count: number): string => `${count} frame${count === 1 ? "" : "s"}`;
  return [
    ["Gaussians", gaussians.toLocaleString("en")],
    ["changed", changed.toLocaleString("en")],
    ["frame", `${formatBytes(frameBytes)}${isCanonical ? ", canonical" : ""}`],
    ["decode", `${decodeMs.toFixed(1)} ms`],
    ["sort", `${sortMs.toFixed(1)} ms`],
    ["upload", `${uploadMs.toFixed(1)} ms`],
    ["buffer", formatFrames(bufferedFrames)],
    ["shown", `${framesPerSecond} of ${frameRate(info).toFixed(0)} per second`],
    ["late", formatFrames(lateFrames)],
    ...(framesBehind === null ? [] : [["behind live", formatFrames(framesBehind)] as const]),
  ];
}
