/** Draws pictures off screen, and returns their pixels. */

import type { Eye } from "./eye.js";
import type { Painter } from "./painter.js";
import { DrawingError } from "./programs.js";

/** The format of the pixels: 32-bit floats, or 8 bits per channel as on the screen. */
export type PixelFormat = "float" | "bytes";

/** Draw the picture of an eye; return [height, width, 3] red, green and blue, from 0 to 1. */
export function takePicture(painter: Painter, eye: Eye, format: PixelFormat): Float32Array {
  const { gl } = painter;
  if (format === "float" && !canBlendFloats(gl)) {
    throw new DrawingError("this graphics card cannot blend floats");
  }
  const { width, height } = eye;
  const maxSize = Math.min(gl.getParameter(gl.MAX_RENDERBUFFER_SIZE), ...gl.getParameter(gl.MAX_VIEWPORT_DIMS));
  if (![width, height].every((size) => Number.isInteger(size) && size > 0 && size <= maxSize)) {
    throw new RangeError(`width and height are ${width} and ${height}, but must be integers from 1 to ${maxSize}`);
  }
  const buffer = gl.createRenderbuffer();
  const target = gl.createFramebuffer();
  gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
  const internalFormat = format === "float" ? gl.RGBA32F : gl.RGBA8;
  gl.renderbufferStorage(gl.RENDERBUFFER, internalFormat, width, height);
  gl.bindFramebuffer(gl.FRAMEBUFFER, target);
  gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, buffer);
  try {
    if (gl.checkFramebufferStatus(gl.FRAMEBUFFER) !== gl.FRAMEBUFFER_COMPLETE) {
      throw new DrawingError(`there is no graphics memory for ${width} x ${height} pixels`);
    }
    painter.paint([{ eye, viewport: { x: 0, y: 0, width, height } }], target);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    return readPixels(gl, width, height, format);
  } finally {
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(target);
    gl.deleteRenderbuffer(buffer);
  }
}

function canBlendFloats(gl: WebGL2RenderingContext): boolean {
  const names = ["EXT_color_buffer_float", "EXT_float_blend"];
  return names.every((name) => gl.getExtension(name) !== null);
}

/** Read the pixels of a framebuffer, and reverse the order of rows, because WebGL begins with the lowest row. */
function readPixels(
  gl: WebGL2RenderingContext,
  width: number,
  height: number,
  format: PixelFormat,
): Float32Array {
  const [componentType, maxValue] = format === "float" ? [gl.FLOAT, 1] : [gl.UNSIGNED_BYTE, 255];
  const ArrayType = format === "float" ? Float32Array : Uint8Array;
  const pixels = new ArrayType(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, componentType, pixels);
  const picture = new Float32Array(3 * width * height);
  for (let pixel = 0; pixel < width * height; pixel++) {
    const row = height - 1 - Math.floor(pixel / width);
    const start = 4 * (row * width + (pixel % width));
    for (let channel = 0; channel < 3; channel++) {
      picture[3 * pixel + channel] = Math.min(1, Math.max(0, (pixels[start + channel] ?? 0) / maxValue));
    }
  }
  return picture;
}
