/** Measures a scene: its up vector, its distance from an eye, and a camera that sees all of it. */

import { eyeAxis, eyeCenter, type Eye, type Vector } from "../draw/eye.js";
import type { CaptureCamera, FramePacket, StreamInfo } from "../protocol.js";
import { add, cross, dot, scale, normalize } from "./pose.js";

const TARGET_SAMPLES = 20_000;
const FRACTION_INSIDE = 0.8;

/** The axes of the world, in the order of SPEC 5.3. */
export const AXES = ["x", "-x", "y", "-y", "z", "-z"] as const;
export type Axis = (typeof AXES)[number];

/** Find the up vector: the requested axis, the header's axis, the metadata key `up`, or the mean of the cameras. */
export function findUp(info: StreamInfo, requestedAxis: Axis | null): Vector {
  const axis = requestedAxis ?? AXES[info.upAxis - 1];
  if (axis !== undefined) {
    const sign = axis.startsWith("-") ? -1 : 1;
    return [axis.endsWith("x") ? sign : 0, axis.endsWith("y") ? sign : 0, axis.endsWith("z") ? sign : 0];
  }
  const metadataUp = parseVector(info.metadata["up"]);
  if (metadataUp !== null) return metadataUp;
  let sum: Vector = [0, 0, 0];
  for (const camera of info.cameras) sum = add(sum, eyeAxis(camera, 1), -1);
  return normalize(sum, [0, 1, 0]);
}

/** Parse a unit vector from a text of three numbers (SPEC I.4); return null if the text is not a direction. */
function parseVector(text = ""): Vector | null {
  const [x = NaN, y = NaN, z = NaN, ...extra] = text.trim().split(/\s+/).map(Number);
  const length = Math.hypot(x, y, z);
  return length > 0 && Number.isFinite(length) && extra.length === 0 ? scale([x, y, z], 1 / length) : null;
}

/** Return the median depth of the positions that an eye sees; if it sees none, twice its minimum depth. */
export function findDistance(eye: Eye, positions: Float32Array | null): number {
  const depths: number[] = [];
  const [right, down, ahead] = [eyeAxis(eye, 0), eyeAxis(eye, 1), eyeAxis(eye, 2)];
  const center = eyeCenter(eye);
  for (const point of listPoints(positions)) {
    const offset = add(point, center, -1);
    const z = dot(ahead, offset);
    const isInsideWidth = Math.abs(dot(right, offset)) * eye.fx < (z * eye.width) / 2;
    const isInsideHeight = Math.abs(dot(down, offset)) * eye.fy < (z * eye.height) / 2;
    if (z > eye.near && isInsideWidth && isInsideHeight) depths.push(z);
  }
  return depths.length > 0 ? quantile(depths, 0.5) : 2 * eye.near;
}

/** Make a camera for a stream without cameras: in front of the scene, and far enough away to see most of it. */
export function makeCamera(positions: Float32Array, up: Vector, isRightHanded: boolean): CaptureCamera {
  const points = [...listPoints(positions)];
  const medians = [0, 1, 2].map((axis) => quantile(points.map((point) => point[axis] ?? 0), 0.5));
  const [x = 0, y = 0, z = 0] = medians;
  const distances = points.map((point) => Math.hypot(...add(point, [x, y, z], -1)));
  const radius = Math.max(1e-3, quantile(distances, FRACTION_INSIDE));
  const ahead = normalize(cross(up, Math.abs(up[0]) < 0.5 ? [1, 0, 0] : [0, 0, 1]), [0, 0, 1]);
  const right = scale(cross(ahead, up), isRightHanded ? 1 : -1);
  const center = add([x, y, z], ahead, -2.5 * radius);
  const down = scale(up, -1);
  return {
    name: "whole scene",
    isHeldOut: false,
    width: 1600,
    height: 900,
    fx: 1000,
    fy: 1000,
    cx: 800,
    cy: 450,
    rotation: [...right, ...down, ...ahead],
    translation: [-dot(right, center), -dot(down, center), -dot(ahead, center)],
    near: radius / 100,
  };
}

/** Return [N, 3] positions of a sample of a packet's Gaussians, world units. */
export function samplePositions({ positions }: FramePacket, info: StreamInfo): Float32Array {
  const count = positions.length / 3;
  const step = Math.max(1, Math.floor(count / TARGET_SAMPLES));
  const latticeUnit = 2 ** -info.latticeExponent;
  const length = 3 * Math.floor(count / step);
  return Float32Array.from({ length }, (_, index) => {
    return latticeUnit * positions[3 * step * Math.floor(index / 3) + (index % 3)]!;
  });
}

function* listPoints(positions: Float32Array | null): Generator<Vector> {
  for (let index = 0; positions !== null && index < positions.length; index += 3) {
    yield [positions[index]!, positions[index + 1]!, positions[index + 2]!];
  }
}

function quantile(values: readonly number[], fraction: number): number {
  const sorted = Float64Array.from(values).sort();
  return sorted[Math.floor(fraction * (sorted.length - 1))] ?? 0;
}
