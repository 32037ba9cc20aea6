/** The placement of a headset's space in the scene, and the eyes of the headset. */

import type { Eye, Vector } from "../draw/eye.js";
import { add, cross, dot, eyeFromPose, normalize, scale, type Pose } from "../view/pose.js";

const PIVOT_METERS = 2; // distance to the pivot at the start, if the stream does not state its scale
const NEAR_METERS = 0.1;
const MAX_RISE = 0.98; // sine of the angle above or below the horizon from which a view is almost vertical

/** Where the space of a headset lies: x points right, y up and z back, as in WebXR; the axes are unit vectors. */
export interface Placement {
  readonly origin: Vector;
  readonly right: Vector;
  readonly up: Vector;
  readonly back: Vector;
  readonly unitsPerMeter: number;
}

/** What is used of the types of WebXR, which TypeScript does not know without `@types/webxr`. */
interface Transform {
  readonly matrix: Float32Array;
}
interface EyeView {
  readonly transform: Transform;
  readonly projectionMatrix: Float32Array;
}
interface Size {
  readonly width: number;
  readonly height: number;
}

/** An axis of a WebXR transform: right (0), up (1), back (2), or the position (3). */
type Column = 0 | 1 | 2 | 3;

/** Place the headset at a pose and upright, looking in its direction; `metersPerUnit` is 0 if unknown. */
export function placeHeadset(pose: Pose, up: Vector, metersPerUnit: number): Placement {
  const handedness = dot(cross(pose.right, pose.down), pose.ahead) < 0 ? -1 : 1; // negative in a mirrored world
  const back = scale(findHorizontalDirection(pose, up), -1);
  const right = scale(cross(up, back), handedness);
  const unitsPerMeter = metersPerUnit > 0 ? 1 / metersPerUnit : pose.distance / PIVOT_METERS;
  return { origin: pose.center, right, up, back, unitsPerMeter };
}

/** Return the horizontal direction of a view; if the view is almost vertical, that of the picture's upper or lower edge. */
function findHorizontalDirection({ ahead, down }: Pose, up: Vector): Vector {
  const rise = dot(ahead, up);
  const direction = Math.abs(rise) > MAX_RISE ? scale(down, Math.sign(rise)) : ahead;
  return normalize(add(direction, up, -dot(direction, up)), ahead);
}

/** Return the pinhole camera of one eye of a headset. */
export function eyeFromView(view: EyeView, { width, height }: Size, placement: Placement): Eye {
  const { matrix } = view.transform;
  const toDirection = (column: Column, sign: 1 | -1): Vector => scale(toWorld(readColumn(matrix, column), placement), sign);
  const center = add(placement.origin, toWorld(readColumn(matrix, 3), placement), placement.unitsPerMeter);
  const pose = { center, right: toDirection(0, 1), down: toDirection(1, -1), ahead: toDirection(2, -1), distance: 1 };
  const [p0 = 1, p5 = 1, p8 = 0, p9 = 0] = [0, 5, 8, 9].map((index) => view.projectionMatrix[index]);
  return eyeFromPose(pose, {
    ...{ rotation: [], translation: [], width, height, near: NEAR_METERS * placement.unitsPerMeter },
    ...{ fx: (p0 * width) / 2, fy: (p5 * height) / 2, cx: ((1 - p8) * width) / 2, cy: ((1 + p9) * height) / 2 },
  });
}

/** Move the headset right and ahead, relative to its horizontal direction, and up; in meters. */
export function moveHeadset(placement: Placement, head: Transform, right: number, up: number, ahead: number): Placement {
  const [x, , z] = normalize(flatten(readColumn(head.matrix, 0)), [1, 0, 0]);
  const step = toWorld([right * x + ahead * z, up, right * z - ahead * x], placement);
  return { ...placement, origin: add(placement.origin, step, placement.unitsPerMeter) };
}

/** Turn to the left by an angle in radians, about the head. */
export function turnHeadset(placement: Placement, head: Transform, angle: number): Placement {
  const { right, back, unitsPerMeter } = placement;
  const turned = {
    ...placement,
    right: add(scale(right, Math.cos(angle)), back, -Math.sin(angle)),
    back: add(scale(back, Math.cos(angle)), right, Math.sin(angle)),
  };
  const position = readColumn(head.matrix, 3);
  const shift = add(toWorld(position, placement), toWorld(position, turned), -1);
  return { ...turned, origin: add(placement.origin, shift, unitsPerMeter) };
}

/** Rotate a vector from the space of the headset into the world. */
function toWorld([x, y, z]: Vector, { right, up, back }: Placement): Vector {
  return add(add(scale(right, x), up, y), back, z);
}

function readColumn(matrix: Float32Array, column: Column): Vector {
  const [x = 0, y = 0, z = 0] = matrix.slice(4 * column, 4 * column + 3);
  return [x, y, z];
}

function flatten([x, , z]: Vector): Vector {
  return [x, 0, z];
}
