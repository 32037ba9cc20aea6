/** The size of a picture's pixels relative to those of the capture, for its low-pass filter (SPEC 10.3). */

import type { Eye } from "./eye.js";

/**
 * Return the focal lengths of an eye in x and y, each divided by the nearest one in the range of the capture's cameras:
 * 1 within the range, and if there are no cameras.
 */
export function measureMagnification(eye: Eye, cameras: readonly Eye[]): [number, number] {
  if (cameras.length === 0) return [1, 1];
  return [
    divideByRange(eye.fx, cameras.map(({ fx }) => fx)),
    divideByRange(eye.fy, cameras.map(({ fy }) => fy)),
  ];
}

function divideByRange(focalLength: number, captureFocalLengths: readonly number[]): number {
  const nearest = Math.max(Math.min(focalLength, Math.max(...captureFocalLengths)), Math.min(...captureFocalLengths));
  return focalLength / nearest;
}
