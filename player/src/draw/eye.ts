/** Cameras from which pictures are taken, and how their pictures fit into the canvas. */

/** Three numbers: x, y, z. */
export type Vector = readonly [number, number, number];

/**
 * A pinhole camera (SPEC 5.6): a world point p is at R p + t in camera coordinates (x right, y down, z ahead) and at
 * pixel (fx x / z + cx, fy y / z + cy). `CaptureCamera` has this type.
 */
export interface Eye {
  /** R, row-major. */
  readonly rotation: readonly number[];
  /** t, world units. */
  readonly translation: readonly number[];
  /** Pixels. */
  readonly width: number;
  readonly height: number;
  readonly fx: number;
  readonly fy: number;
  readonly cx: number;
  readonly cy: number;
  /** Minimum visible depth, world units. */
  readonly near: number;
}

/** A rectangle of pixels, from the upper left corner. */
export interface Area {
  readonly left: number;
  readonly top: number;
  readonly width: number;
  readonly height: number;
}

/** The row of R for the distance of a point to the right (0), down (1) or ahead (2). */
export function axisOf(eye: Eye, row: 0 | 1 | 2): Vector {
  const [x = 0, y = 0, z = 0] = eye.rotation.slice(3 * row, 3 * row + 3);
  return [x, y, z];
}

/** The position of the eye in the world: -R' t, if R only rotates and mirrors. */
export function centerOf(eye: Eye): Vector {
  const [x = 0, y = 0, z = 0] = eye.translation;
  const [right, down, ahead] = [axisOf(eye, 0), axisOf(eye, 1), axisOf(eye, 2)];
  const along = (k: 0 | 1 | 2): number => -(right[k] * x + down[k] * y + ahead[k] * z);
  return [along(0), along(1), along(2)];
}

/** The largest area with the eye's proportions in the middle of a canvas. */
export function fitArea(eye: Eye, width: number, height: number): Area {
  const scale = Math.min(width / eye.width, height / eye.height);
  const size = { width: Math.round(eye.width * scale), height: Math.round(eye.height * scale) };
  return {
    left: Math.floor((width - size.width) / 2),
    top: Math.floor((height - size.height) / 2),
    ...size,
  };
}

/** The same picture with another number of pixels. */
export function resizeEye(eye: Eye, width: number, height: number): Eye {
  const [across, down] = [width / eye.width, height / eye.height];
  return {
    ...eye,
    width,
    height,
    fx: eye.fx * across,
    cx: eye.cx * across,
    fy: eye.fy * down,
    cy: eye.cy * down,
  };
}

/** A picture of another size that also shows the surroundings; the original picture keeps its scale. */
export function widenEye(eye: Eye, width: number, height: number): Eye {
  const area = fitArea(eye, width, height);
  const inner = resizeEye(eye, area.width, area.height);
  return { ...inner, width, height, cx: inner.cx + area.left, cy: inner.cy + area.top };
}
