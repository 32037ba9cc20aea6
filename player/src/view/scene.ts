/** Measures of a scene: its up vector, its distance, and a camera that sees it. */

import { axisOf, centerOf, type Eye, type Vector } from "../draw/eye.js";
import type { CaptureCamera, FramePacket, StreamInfo } from "../protocol.js";
import { add, cross, dot, scale, unit } from "./stand.js";

const SAMPLES = 20_000;
const SHARE_INSIDE = 0.8;

/** An axis of the world, in the order of SPEC 5.3. */
export const AXES = ["x", "-x", "y", "-y", "z", "-z"] as const;
export type Axis = (typeof AXES)[number];

/** The up vector: the requested axis, else the stream's, else the mean of its cameras' up vectors. */
export function findUp(info: StreamInfo, wanted: Axis | null): Vector {
  const axis = wanted ?? AXES[info.upAxis - 1];
  if (axis !== undefined) {
    const sign = axis.startsWith("-") ? -1 : 1;
    return [axis.endsWith("x") ? sign : 0, axis.endsWith("y") ? sign : 0, axis.endsWith("z") ? sign : 0];
  }
  const stated = parseVector(info.metadata["up"]);
  if (stated !== null) return stated;
  let total: Vector = [0, 0, 0];
  for (const camera of info.cameras) total = add(total, axisOf(camera, 1), -1);
  return unit(total, [0, 1, 0]);
}

/** The unit vector given by three numbers in a text (SPEC I.4); null if there is none. */
function parseVector(text = ""): Vector | null {
  const [x = NaN, y = NaN, z = NaN, ...more] = text.trim().split(/\s+/).map(Number);
  const length = Math.hypot(x, y, z);
  return length > 0 && Number.isFinite(length) && more.length === 0 ? scale([x, y, z], 1 / length) : null;
}

/** Median depth of the positions that an eye sees; twice its near plane if it sees none. */
export function findDistance(eye: Eye, places: Float32Array | null): number {
  const depths: number[] = [];
  const [right, down, ahead] = [axisOf(eye, 0), axisOf(eye, 1), axisOf(eye, 2)];
  const center = centerOf(eye);
  for (const place of placesOf(places)) {
    const offset = add(place, center, -1);
    const z = dot(ahead, offset);
    const isAcross = Math.abs(dot(right, offset)) * eye.fx < (z * eye.width) / 2;
    const isDown = Math.abs(dot(down, offset)) * eye.fy < (z * eye.height) / 2;
    if (z > eye.near && isAcross && isDown) depths.push(z);
  }
  return depths.length > 0 ? quantile(depths, 0.5) : 2 * eye.near;
}

/** A camera for a stream that has none: in front of the scene, far enough to see most of it. */
export function makeCamera(sampled: Float32Array, up: Vector, isRightHanded: boolean): CaptureCamera {
  const places = [...placesOf(sampled)];
  const middle = [0, 1, 2].map((k) => quantile(places.map((place) => place[k] ?? 0), 0.5));
  const [x = 0, y = 0, z = 0] = middle;
  const lengths = places.map((place) => Math.hypot(...add(place, [x, y, z], -1)));
  const radius = Math.max(1e-3, quantile(lengths, SHARE_INSIDE));
  const ahead = unit(cross(up, Math.abs(up[0]) < 0.5 ? [1, 0, 0] : [0, 0, 1]), [0, 0, 1]);
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

/** [n, 3] positions of some of a packet's Gaussians, world units. */
export function samplePlaces({ positions }: FramePacket, info: StreamInfo): Float32Array {
  const count = positions.length / 3;
  const step = Math.max(1, Math.floor(count / SAMPLES));
  const size = 2 ** -info.latticeExponent;
  const length = 3 * Math.floor(count / step);
  return Float32Array.from({ length }, (_, at) => {
    return size * positions[3 * step * Math.floor(at / 3) + (at % 3)]!;
  });
}

function* placesOf(places: Float32Array | null): Generator<Vector> {
  for (let at = 0; places !== null && at < places.length; at += 3) {
    yield [places[at]!, places[at + 1]!, places[at + 2]!];
  }
}

function quantile(values: readonly number[], share: number): number {
  const sorted = Float64Array.from(values).sort();
  return sorted[Math.floor(share * (sorted.length - 1))] ?? 0;
}
