/** Pinhole cameras from which pictures are drawn, and the placement of their pictures on the canvas. */

/** Three numbers: x, y, z. */
export type Vector = readonly [number, number, number];

/**
 * A pinhole camera (SPEC 5.6). The camera coordinates of a world point p are (x, y, z) = R p + t, with x right, y down
 * and z ahead. Its pixel is (fx x / z + cx, fy y / z + cy). A `CaptureCamera` is an `Eye`.
 */
export interface Eye {
  /** [3, 3] the rotation R, row by row. */
  readonly rotation: readonly number[];
  /** [3] the translation t, world units. */
  readonly translation: readonly number[];
  /** Size, focal lengths and principal point, pixels. */
  readonly width: number;
  readonly height: number;
  readonly fx: number;
  readonly fy: number;
  readonly cx: number;
  readonly cy: number;
  /** Minimum visible depth, world units. */
  readonly near: number;
}

/** A rectangle of pixels; the origin is the upper left corner of the canvas. */
export interface Area {
  readonly left: number;
  readonly top: number;
  readonly width: number;
  readonly height: number;
}

/** A row of R: the direction in the world that points right (0), down (1) or ahead (2) in the picture. */
export function eyeAxis(eye: Eye, row: 0 | 1 | 2): Vector {
  const [x = 0, y = 0, z = 0] = eye.rotation.slice(3 * row, 3 * row + 3);
  return [x, y, z];
}

/** The position of the eye in the world: -R^T t, for an orthogonal R. */
export function eyeCenter(eye: Eye): Vector {
  const [x = 0, y = 0, z = 0] = eye.translation;
  const [right, down, ahead] = [eyeAxis(eye, 0), eyeAxis(eye, 1), eyeAxis(eye, 2)];
  const centerCoordinate = (k: 0 | 1 | 2): number => -(right[k] * x + down[k] * y + ahead[k] * z);
  return [centerCoordinate(0), centerCoordinate(1), centerCoordinate(2)];
}

/** Return the largest centered area of a canvas that has the aspect ratio of the eye's picture. */
export function fitArea(eye: Eye, width: number, height: number): Area {
  const scale = Math.min(width / eye.width, height / eye.height);
  const size = { width: Math.round(eye.width * scale), height: Math.round(eye.height * scale) };
  return {
    left: Math.floor((width - size.width) / 2),
    top: Math.floor((height - size.height) / 2),
    ...size,
  };
}

/** Scale the picture of an eye to another size in pixels. */
export function resizeEye(eye: Eye, width: number, height: number): Eye {
  const [scaleX, scaleY] = [width / eye.width, height / eye.height];
  return {
    ...eye,
    width,
    height,
    fx: eye.fx * scaleX,
    cx: eye.cx * scaleX,
    fy: eye.fy * scaleY,
    cy: eye.cy * scaleY,
  };
}

/** Extend the picture of an eye to another aspect ratio: the whole canvas is filled, and nothing is cut off. */
export function widenEye(eye: Eye, width: number, height: number): Eye {
  const area = fitArea(eye, width, height);
  const resized = resizeEye(eye, area.width, area.height);
  return { ...resized, width, height, cx: resized.cx + area.left, cy: resized.cy + area.top };
}
