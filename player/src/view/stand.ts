/** Position and movement of a viewer, as pure functions. */

import { axisOf, centerOf, type Eye, type Vector } from "../draw/eye.js";

const LEAST_ANGLE = 0.05; // minimum angle in radians between the line of sight and up or down
const LEAST_DISTANCE = 1e-3;

/** A position, a direction, and a pivot ahead that the viewer orbits. */
export interface Stand {
  readonly center: Vector;
  readonly right: Vector;
  readonly down: Vector;
  readonly ahead: Vector;
  /** From the center to the pivot, world units. */
  readonly distance: number;
}

/** The stand of an eye. */
export function standAt(eye: Eye, distance: number): Stand {
  return {
    center: centerOf(eye),
    right: axisOf(eye, 0),
    down: axisOf(eye, 1),
    ahead: axisOf(eye, 2),
    distance: Math.max(LEAST_DISTANCE, distance),
  };
}

/** An eye moved to where the viewer stands. */
export function eyeAt(stand: Stand, eye: Eye): Eye {
  const { center, right, down, ahead } = stand;
  return {
    ...eye,
    rotation: [...right, ...down, ...ahead],
    translation: [-dot(right, center), -dot(down, center), -dot(ahead, center)],
  };
}

/** Orbit the pivot by angles in radians: the scene follows a finger to the right and down. */
export function orbit(stand: Stand, up: Vector, across: number, along: number): Stand {
  const pivot = add(stand.center, stand.ahead, stand.distance);
  const turned = turn(stand, up, across, along);
  return { ...turned, center: add(pivot, turned.ahead, -stand.distance) };
}

/** Look around from the same position, by angles in radians. */
export function turn(stand: Stand, up: Vector, across: number, along: number): Stand {
  const sense = dot(cross(stand.right, stand.down), stand.ahead) < 0 ? -1 : 1; // in a mirrored world
  const upright = dot(stand.down, up) > 0 ? -1 : 1; // upside down, left is right
  const yawed = rotate(stand, up, -across * sense * upright);
  const angle = Math.acos(Math.min(1, Math.max(-1, dot(yawed.ahead, up))));
  const most = upright * along;
  const tilted = Math.min(Math.PI - LEAST_ANGLE, Math.max(LEAST_ANGLE, angle + most));
  return rotate(yawed, yawed.right, -(tilted - angle) * sense * upright);
}

/** Move right, down and ahead, world units. */
export function move(stand: Stand, right: number, down: number, ahead: number): Stand {
  const sideways = add(stand.center, stand.right, right);
  return { ...stand, center: add(add(sideways, stand.down, down), stand.ahead, ahead) };
}

/** Move towards the pivot: a factor of 0.5 halves the distance. */
export function approach(stand: Stand, factor: number): Stand {
  const distance = Math.max(LEAST_DISTANCE, stand.distance * factor);
  return { ...move(stand, 0, 0, stand.distance - distance), distance };
}

/** Rotate by 180 degrees about the line of sight. */
export function flip(stand: Stand): Stand {
  return { ...stand, right: scale(stand.right, -1), down: scale(stand.down, -1) };
}

export function dot(a: Vector, b: Vector): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

export function cross(a: Vector, b: Vector): Vector {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

export function scale(a: Vector, by: number): Vector {
  return [a[0] * by, a[1] * by, a[2] * by];
}

/** a + b * times. */
export function add(a: Vector, b: Vector, times = 1): Vector {
  return [a[0] + b[0] * times, a[1] + b[1] * times, a[2] + b[2] * times];
}

/** The vector scaled to length 1; `instead` if its length is 0. */
export function unit(a: Vector, instead: Vector): Vector {
  const length = Math.hypot(...a);
  return length > 1e-9 ? scale(a, 1 / length) : instead;
}

/** Rotate the axes about a unit vector; they stay orthonormal. */
function rotate(stand: Stand, about: Vector, angle: number): Stand {
  const turned = (axis: Vector): Vector => {
    const along = scale(about, dot(about, axis) * (1 - Math.cos(angle)));
    return add(add(scale(axis, Math.cos(angle)), cross(about, axis), Math.sin(angle)), along);
  };
  const ahead = unit(turned(stand.ahead), stand.ahead);
  const raw = turned(stand.right);
  const right = unit(add(raw, ahead, -dot(raw, ahead)), stand.right);
  const sense = dot(cross(stand.right, stand.down), stand.ahead) < 0 ? -1 : 1;
  return { ...stand, ahead, right, down: scale(cross(ahead, right), sense) };
}
