/** The size of a picture relative to pictures of the capture, for the low-pass filter (SPEC 10.3). */

import { eyeCenter, type Eye, type Vector } from "./eye.js";

const WEIGHT_EXPONENT = -8; // of the distance to a capture camera

export interface Magnification {
  /** The focal lengths, divided by the nearest ones in the ranges of the capture's cameras. */
  readonly x: number;
  readonly y: number;
  /** The mean center of the capture's cameras, of which the nearest weigh most. */
  readonly center: Vector;
}

/** Return the magnification of an eye's picture; without cameras, nothing is magnified. */
export function measureMagnification(eye: Eye, cameras: readonly Eye[]): Magnification {
  if (cameras.length === 0) return { x: 1, y: 1, center: eyeCenter(eye) };
  return {
    x: divideByRange(eye.fx, cameras.map(({ fx }) => fx)),
    y: divideByRange(eye.fy, cameras.map(({ fy }) => fy)),
    center: findCaptureCenter(eyeCenter(eye), cameras.map(eyeCenter)),
  };
}

function divideByRange(focalLength: number, captureFocalLengths: readonly number[]): number {
  const nearest = Math.max(Math.min(focalLength, Math.max(...captureFocalLengths)), Math.min(...captureFocalLengths));
  return focalLength / nearest;
}

/** Return the mean of the centers of capture cameras, of which the nearest weigh most. */
function findCaptureCenter(center: Vector, captureCenters: readonly Vector[]): Vector {
  const distances = captureCenters.map((other) => Math.hypot(...other.map((value, axis) => value - center[axis]!)));
  const minDistance = Math.min(...distances);
  if (!(minDistance > 0)) return center;
  const weights = distances.map((distance) => (distance / minDistance) ** WEIGHT_EXPONENT);
  const weightSum = weights.reduce((sum, weight) => sum + weight, 0);
  const mean = (axis: 0 | 1 | 2): number =>
    weights.reduce((sum, weight, index) => sum + weight * captureCenters[index]![axis], 0) / weightSum;
  return [mean(0), mean(1), mean(2)];
}
