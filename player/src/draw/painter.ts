/**
 * Draws the Gaussians of a frame as in SPEC 10.3.
 *
 * They are blended back to front, because eight bits suffice for this: each blend rounds by half a step, and Gaussians
 * in front attenuate the error; front to back, small contributions would be rounded to nothing. One rule cannot be
 * implemented by blending: a pixel does not stop at T <= 1e-4. The difference is the Gaussians behind, one hundredth of
 * the light at most.
 */

import type { FramePacket, StreamInfo } from "../protocol.js";
import { centerOf, type Area, type Eye } from "./eye.js";
import { buildProgram, DrawingError, numberSamplers } from "./programs.js";
import { SlotTextures } from "./slot-textures.js";
import { samplerNames, SPLAT_FRAGMENT_SHADER, splatVertexShader } from "./splat-shaders.js";

const NEAR_FRACTION = 0.8; // SPEC 3.1
const CORNERS = 4;

const CONTEXT: WebGLContextAttributes = {
  alpha: false,
  antialias: false,
  depth: false,
  stencil: false,
  powerPreference: "high-performance",
};

export class Painter {
  readonly gl: WebGL2RenderingContext;
  readonly #program: WebGLProgram;
  readonly #slots: SlotTextures;
  readonly #orderBuffer: WebGLBuffer;
  readonly #vertices: WebGLVertexArrayObject;
  readonly #uniforms = new Map<string, WebGLUniformLocation | null>();
  #count = 0;

  /** A painter of streams with the same header. */
  constructor(gl: WebGL2RenderingContext, info: StreamInfo) {
    this.gl = gl;
    this.#program = buildProgram(gl, splatVertexShader(info.shDegree), SPLAT_FRAGMENT_SHADER);
    this.#slots = new SlotTextures(gl, info.shDegree);
    this.#orderBuffer = gl.createBuffer();
    this.#vertices = gl.createVertexArray();
    gl.bindVertexArray(this.#vertices);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#orderBuffer);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribIPointer(0, 1, gl.UNSIGNED_INT, 0, 0);
    gl.vertexAttribDivisor(0, 1);
    gl.bindVertexArray(null);
    gl.disable(gl.DITHER);
    numberSamplers(gl, this.#program, samplerNames(info.shDegree));
    this.#setSteps(info);
  }

  /** Upload the changes of a frame, without drawing. */
  apply(packet: FramePacket): void {
    this.#slots.apply(packet);
  }

  /** Set the slots to draw, farthest first. */
  setOrder(order: Uint32Array): void {
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.#orderBuffer);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, order, this.gl.STREAM_DRAW);
    this.#count = order.length;
  }

  /** Draw what an eye sees into an area of its size; the rest of the canvas is black. */
  paint(eye: Eye, area: Area, height: number, target: WebGLFramebuffer | null = null): void {
    const gl = this.gl;
    const bottom = height - area.top - area.height;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.disable(gl.SCISSOR_TEST);
    gl.clearColor(0, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.viewport(area.left, bottom, area.width, area.height);
    gl.scissor(area.left, bottom, area.width, area.height);
    gl.enable(gl.SCISSOR_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.useProgram(this.#program);
    this.#setEye(eye);
    this.#slots.textures.forEach((texture, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
    });
    gl.activeTexture(gl.TEXTURE0);
    gl.bindVertexArray(this.#vertices);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, CORNERS, this.#count);
    gl.bindVertexArray(null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  dispose(): void {
    this.#slots.dispose();
    this.gl.deleteBuffer(this.#orderBuffer);
    this.gl.deleteVertexArray(this.#vertices);
    this.gl.deleteProgram(this.#program);
  }

  #setSteps(info: StreamInfo): void {
    const { logScaleStep, opacityStep, shDcStep, shRestStep } = info;
    this.gl.uniform1f(this.#find("unit"), 2 ** -info.latticeExponent);
    this.gl.uniform4f(this.#find("steps"), logScaleStep, opacityStep, shDcStep, shRestStep);
  }

  #setEye(eye: Eye): void {
    const gl = this.gl;
    gl.uniformMatrix3fv(this.#find("rotation"), true, eye.rotation);
    gl.uniform3fv(this.#find("translation"), eye.translation);
    gl.uniform3fv(this.#find("center"), centerOf(eye));
    gl.uniform2f(this.#find("focal"), eye.fx, eye.fy);
    gl.uniform2f(this.#find("principal"), eye.cx, eye.cy);
    gl.uniform2f(this.#find("size"), eye.width, eye.height);
    gl.uniform1f(this.#find("nearest"), NEAR_FRACTION * eye.near);
  }

  #find(name: string): WebGLUniformLocation | null {
    const known = this.#uniforms.get(name);
    if (known !== undefined) return known;
    const found = this.gl.getUniformLocation(this.#program, name);
    this.#uniforms.set(name, found);
    return found;
  }
}

/** Open a canvas for drawing. */
export function openContext(canvas: HTMLCanvasElement): WebGL2RenderingContext {
  const gl = canvas.getContext("webgl2", CONTEXT);
  if (gl === null) throw new DrawingError("this browser has no WebGL2, or it is disabled");
  return gl;
}
