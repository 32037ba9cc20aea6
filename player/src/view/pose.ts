/** The pose of the viewer, and pure functions that move it. */

import { eyeAxis, eyeCenter, type Eye, type Vector } from "../draw/eye.js";

const MIN_ANGLE = 0.05; // minimum angle in radians between the line of sight and up or down
const MIN_DISTANCE = 1e-3;

/** A position, three axes, and the distance to a pivot ahead, which the viewer orbits. */
export interface Pose {
  readonly center: Vector;
  readonly right: Vector;
  readonly down: Vector;
  readonly ahead: Vector;
  /** Distance from the center to the pivot, world units. */
  readonly distance: number;
}

/** Return the pose of an eye whose pivot is `distance` world units ahead. */
export function poseFromEye(eye: Eye, distance: number): Pose {
  return {
    center: eyeCenter(eye),
    right: eyeAxis(eye, 0),
    down: eyeAxis(eye, 1),
    ahead: eyeAxis(eye, 2),
    distance: Math.max(MIN_DISTANCE, distance),
  };
}

/** Return an eye with the pose of the viewer. */
export function eyeFromPose(pose: Pose, eye: Eye): Eye {
  const { center, right, down, ahead } = pose;
  return {
    ...eye,
    rotation: [...right, ...down, ...ahead],
    translation: [-dot(right, center), -dot(down, center), -dot(ahead, center)],
  };
}

/** Orbit the pivot by angles in radians; positive angles turn the scene to the right and down. */
export function orbit(pose: Pose, up: Vector, yaw: number, pitch: number): Pose {
  const pivot = add(pose.center, pose.ahead, pose.distance);
  const turnedPose = turn(pose, up, yaw, pitch);
  return { ...turnedPose, center: add(pivot, turnedPose.ahead, -pose.distance) };
}

/** Turn by angles in radians, without moving. */
export function turn(pose: Pose, up: Vector, yaw: number, pitch: number): Pose {
  const handedness = dot(cross(pose.right, pose.down), pose.ahead) < 0 ? -1 : 1; // negative in a mirrored world
  const uprightSign = dot(pose.down, up) > 0 ? -1 : 1; // negative if the view is upside down
  const yawedPose = rotate(pose, up, -yaw * handedness * uprightSign);
  const angle = Math.acos(Math.min(1, Math.max(-1, dot(yawedPose.ahead, up))));
  const pitchChange = uprightSign * pitch;
  const newAngle = Math.min(Math.PI - MIN_ANGLE, Math.max(MIN_ANGLE, angle + pitchChange));
  return rotate(yawedPose, yawedPose.right, -(newAngle - angle) * handedness * uprightSign);
}

/** Move right, down and ahead, world units. */
export function move(pose: Pose, right: number, down: number, ahead: number): Pose {
  const movedRight = add(pose.center, pose.right, right);
  return { ...pose, center: add(add(movedRight, pose.down, down), pose.ahead, ahead) };
}

/** Multiply the distance to the pivot by a factor, by moving ahead or back. */
export function approach(pose: Pose, factor: number): Pose {
  const distance = Math.max(MIN_DISTANCE, pose.distance * factor);
  return { ...move(pose, 0, 0, pose.distance - distance), distance };
}

/** Rotate by 180 degrees about the line of sight. */
export function flip(pose: Pose): Pose {
  return { ...pose, right: scale(pose.right, -1), down: scale(pose.down, -1) };
}

export function dot(a: Vector, b: Vector): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

export function cross(a: Vector, b: Vector): Vector {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

export function scale(a: Vector, factor: number): Vector {
  return [a[0] * factor, a[1] * factor, a[2] * factor];
}

/** Return a + b * factor. */
export function add(a: Vector, b: Vector, factor = 1): Vector {
  return [a[0] + b[0] * factor, a[1] + b[1] * factor, a[2] + b[2] * factor];
}

/** Scale a vector to length 1; return `fallback` if its length is almost 0. */
export function normalize(a: Vector, fallback: Vector): Vector {
  const length = Math.hypot(...a);
  return length > 1e-9 ? scale(a, 1 / length) : fallback;
}

/** Rotate a pose about a unit vector by an angle in radians; the axes stay orthonormal. */
function rotate(pose: Pose, axis: Vector, angle: number): Pose {
  const rotateVector = (vector: Vector): Vector => {
    const parallel = scale(axis, dot(axis, vector) * (1 - Math.cos(angle)));
    return add(add(scale(vector, Math.cos(angle)), cross(axis, vector), Math.sin(angle)), parallel);
  };
  const ahead = normalize(rotateVector(pose.ahead), pose.ahead);
  const rotatedRight = rotateVector(pose.right);
  const right = normalize(add(rotatedRight, ahead, -dot(rotatedRight, ahead)), pose.right);
  const handedness = dot(cross(pose.right, pose.down), pose.ahead) < 0 ? -1 : 1;
  return { ...pose, ahead, right, down: scale(cross(ahead, right), handedness) };
}
