/** Pictures as numbers, drawn off screen. */

import type { Eye } from "./eye.js";
import type { Painter } from "./painter.js";
import { DrawingError } from "./programs.js";

/** The format of the target: 32-bit floats, or the 8 bits of the screen. */
export type Depth = "float" | "bytes";

/** Draw what an eye sees at its own size; returns red, green, blue from 0 to 1, row by row. */
export function takePicture(painter: Painter, eye: Eye, depth: Depth): Float32Array {
  const { gl } = painter;
  if (depth === "float" && !canBlendFloats(gl)) {
    throw new DrawingError("this graphics card cannot blend floats");
  }
  const { width, height } = eye;
  const buffer = gl.createRenderbuffer();
  const target = gl.createFramebuffer();
  gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
  const format = depth === "float" ? gl.RGBA32F : gl.RGBA8;
  gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
  gl.bindFramebuffer(gl.FRAMEBUFFER, target);
  gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, buffer);
  painter.paint(eye, { left: 0, top: 0, width, height }, height, target);
  gl.bindFramebuffer(gl.FRAMEBUFFER, target);
  const pixels = readPixels(gl, width, height, depth);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.deleteFramebuffer(target);
  gl.deleteRenderbuffer(buffer);
  return pixels;
}

function canBlendFloats(gl: WebGL2RenderingContext): boolean {
  const names = ["EXT_color_buffer_float", "EXT_float_blend"];
  return names.every((name) => gl.getExtension(name) !== null);
}

/** Read a framebuffer from top to bottom; its first row is the lowest. */
function readPixels(
  gl: WebGL2RenderingContext,
  width: number,
  height: number,
  depth: Depth,
): Float32Array {
  const [kind, most] = depth === "float" ? [gl.FLOAT, 1] : [gl.UNSIGNED_BYTE, 255];
  const Data = depth === "float" ? Float32Array : Uint8Array;
  const read = new Data(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, kind, read);
  const picture = new Float32Array(3 * width * height);
  for (let pixel = 0; pixel < width * height; pixel++) {
    const row = height - 1 - Math.floor(pixel / width);
    const from = 4 * (row * width + (pixel % width));
    for (let k = 0; k < 3; k++) {
      picture[3 * pixel + k] = Math.min(1, Math.max(0, (read[from + k] ?? 0) / most));
    }
  }
  return picture;
}
