/**
 * Draws the Gaussians of a frame as in SPEC 10.3.
 *
 * Gaussians are blended back to front, for which 8 bits per channel suffice: each blend rounds by half a step, and the
 * Gaussians in front attenuate the error. Front to back, small contributions would be rounded to 0. Blending cannot
 * implement one rule of SPEC 10.3, by which a pixel stops at T <= 1e-4. The Gaussians that this rule leaves out
 * contribute at most one hundredth of the light.
 */

import type { CaptureCamera, FramePacket, StreamInfo } from "../protocol.js";
import { eyeCenter, type Eye } from "./eye.js";
import { measureMagnification } from "./magnification.js";
import { buildProgram, DrawingError, numberSamplers } from "./programs.js";
import { SlotTextures } from "./slot-textures.js";
import { INSTANCE_SPLATS, samplerNames, SPLAT_FRAGMENT_SHADER, splatVertexShader } from "./splat-shaders.js";

const NEAR_FRACTION = 0.8; // SPEC 3.1
const SLOT_VECTORS = INSTANCE_SPLATS / 4; // vertex attributes that contain the slots of an instance
const CORNERS_OF_TRIANGLES = [0, 1, 2, 2, 1, 3];
/** The corners of the triangles of an instance; a splat has two triangles and four corners. */
const CORNERS = Array.from({ length: INSTANCE_SPLATS }, (_, splat) => CORNERS_OF_TRIANGLES.map((corner) => 4 * splat + corner)).flat();

/** A rectangle of pixels; the origin is the lower left corner, as in WebGL and WebXR. */
export interface Viewport {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

/** The picture of an eye, and the part of a framebuffer that it fills; both have the same size. */
export interface PlacedPicture {
  readonly eye: Eye;
  readonly viewport: Viewport;
}

const CONTEXT_ATTRIBUTES: WebGLContextAttributes = {
  antialias: false,
  depth: false,
  stencil: false,
  powerPreference: "high-performance",
};

export class Painter {
  readonly gl: WebGL2RenderingContext;
  readonly #program: WebGLProgram;
  readonly #slotTextures: SlotTextures;
  readonly #orderBuffer: WebGLBuffer;
  readonly #cornerBuffer: WebGLBuffer;
  readonly #vertexArray: WebGLVertexArrayObject;
  readonly #backgroundAlpha: number;
  readonly #uniforms = new Map<string, WebGLUniformLocation | null>();
  #splatCount = 0;
  /** How far Gaussians have moved to the current frame: 0 is the previous frame, which `apply` must have kept. */
  progress = 1;
  /** The cameras of the capture, to which the magnification of pictures is relative. */
  captureCameras: readonly CaptureCamera[];

  /** Create a painter for a stream; the header determines shaders and textures. */
  constructor(gl: WebGL2RenderingContext, info: StreamInfo) {
    this.gl = gl;
    this.captureCameras = info.cameras;
    this.#backgroundAlpha = gl.getContextAttributes()?.alpha ? 0 : 1;
    this.#program = buildProgram(gl, splatVertexShader(info.shDegree), SPLAT_FRAGMENT_SHADER);
    this.#slotTextures = new SlotTextures(gl, info.shDegree);
    this.#orderBuffer = gl.createBuffer();
    this.#cornerBuffer = gl.createBuffer();
    this.#vertexArray = gl.createVertexArray();
    this.#describeInstances();
    gl.disable(gl.DITHER);
    numberSamplers(gl, this.#program, samplerNames(info.shDegree));
    this.#setSteps(info);
  }

  /** Upload the changes of a frame, and possibly keep the previous frame; this does not draw the frame. */
  apply(packet: FramePacket, keepsPrevious: boolean): void {
    this.#slotTextures.apply(packet, keepsPrevious);
  }

  /** Set the slots to draw, farthest first. */
  setOrder(order: Uint32Array): void {
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.#orderBuffer);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, 4 * INSTANCE_SPLATS * countInstances(order.length), this.gl.STREAM_DRAW);
    this.gl.bufferSubData(this.gl.ARRAY_BUFFER, 0, order);
    this.#splatCount = order.length;
  }

  /** Make a framebuffer black or transparent, by default that of the canvas, and draw pictures into parts of it. */
  paint(pictures: readonly PlacedPicture[], target: WebGLFramebuffer | null = null): void {
    const gl = this.gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.disable(gl.SCISSOR_TEST);
    gl.clearColor(0, 0, 0, this.#backgroundAlpha);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.enable(gl.SCISSOR_TEST);
    for (const { eye, viewport } of pictures) this.#paintEye(eye, viewport);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  dispose(): void {
    this.#slotTextures.dispose();
    this.gl.deleteBuffer(this.#orderBuffer);
    this.gl.deleteBuffer(this.#cornerBuffer);
    this.gl.deleteVertexArray(this.#vertexArray);
    this.gl.deleteProgram(this.#program);
  }

  #paintEye(eye: Eye, { x, y, width, height }: Viewport): void {
    const gl = this.gl;
    gl.viewport(x, y, width, height);
    gl.scissor(x, y, width, height);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.useProgram(this.#program);
    this.#setEye(eye);
    this.#slotTextures.textures.forEach((texture, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
    });
    gl.activeTexture(gl.TEXTURE0);
    gl.bindVertexArray(this.#vertexArray);
    gl.drawElementsInstanced(gl.TRIANGLES, CORNERS.length, gl.UNSIGNED_BYTE, 0, countInstances(this.#splatCount));
    gl.bindVertexArray(null);
  }

  /** An instance draws several splats, because graphics cards and drivers draw many small instances slowly. */
  #describeInstances(): void {
    const gl = this.gl;
    gl.bindVertexArray(this.#vertexArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#orderBuffer);
    for (let vector = 0; vector < SLOT_VECTORS; vector++) {
      gl.enableVertexAttribArray(vector);
      gl.vertexAttribIPointer(vector, 4, gl.UNSIGNED_INT, 4 * INSTANCE_SPLATS, 16 * vector);
      gl.vertexAttribDivisor(vector, 1);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.#cornerBuffer);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, Uint8Array.from(CORNERS), gl.STATIC_DRAW);
    gl.bindVertexArray(null);
  }

  #setSteps(info: StreamInfo): void {
    const { logScaleStep, opacityStep, shDcStep, shRestStep } = info;
    this.gl.uniform1f(this.#findUniform("unit"), 2 ** -info.latticeExponent);
    this.gl.uniform4f(this.#findUniform("steps"), logScaleStep, opacityStep, shDcStep, shRestStep);
  }

  #setEye(eye: Eye): void {
    const gl = this.gl;
    gl.uniformMatrix3fv(this.#findUniform("rotation"), true, eye.rotation);
    gl.uniform3fv(this.#findUniform("translation"), eye.translation);
    gl.uniform3fv(this.#findUniform("center"), eyeCenter(eye));
    gl.uniform2f(this.#findUniform("focal"), eye.fx, eye.fy);
    gl.uniform2f(this.#findUniform("principal"), eye.cx, eye.cy);
    gl.uniform2f(this.#findUniform("size"), eye.width, eye.height);
    const magnification = measureMagnification(eye, this.captureCameras);
    gl.uniform2f(this.#findUniform("magnification"), magnification.x, magnification.y);
    gl.uniform3fv(this.#findUniform("captureCenter"), magnification.center);
    gl.uniform1f(this.#findUniform("nearest"), NEAR_FRACTION * eye.near);
    gl.uniform1ui(this.#findUniform("count"), this.#splatCount);
    gl.uniform1f(this.#findUniform("progress"), this.progress);
  }

  #findUniform(name: string): WebGLUniformLocation | null {
    const cached = this.#uniforms.get(name);
    if (cached !== undefined) return cached;
    const location = this.gl.getUniformLocation(this.#program, name);
    this.#uniforms.set(name, location);
    return location;
  }
}

const countInstances = (splatCount: number): number => Math.ceil(splatCount / INSTANCE_SPLATS);

/** Why a canvas cannot get a player. */
const obstacles = new WeakMap<HTMLCanvasElement, string>();

/**
 * Return the WebGL2 context of a canvas for one player; it can be transparent. Throws DrawingError if there is none, if
 * another player has it, if it was released, or if its transparency differs.
 */
export function openContext(canvas: HTMLCanvasElement, transparent: boolean): WebGL2RenderingContext {
  const obstacle = obstacles.get(canvas);
  if (obstacle !== undefined) throw new DrawingError(obstacle);
  const gl = canvas.getContext("webgl2", { ...CONTEXT_ATTRIBUTES, alpha: transparent });
  if (gl === null) {
    const scratch = document.createElement("canvas");
    const other = scratch.getContext("webgl2");
    if (other === null) throw new DrawingError("this browser has no WebGL2, or it is disabled");
    closeContext(scratch, other);
    throw new DrawingError("this canvas already has a context that is not WebGL2");
  }
  // A context keeps its first attributes; if it is lost, they are unknown.
  if (gl.getContextAttributes()?.alpha === !transparent) {
    throw new DrawingError(`the context of this canvas is ${transparent ? "not " : ""}transparent: use another canvas`);
  }
  obstacles.set(canvas, "this canvas has a player already: call its method dispose() first");
  return gl;
}

/** Make a canvas on the page usable for another player; release the context of any other, because browsers have few. */
export function closeContext(canvas: HTMLCanvasElement, gl: WebGL2RenderingContext): void {
  if (canvas.isConnected) return void obstacles.delete(canvas);
  obstacles.set(canvas, "the graphics context of this canvas was released by dispose()");
  gl.getExtension("WEBGL_lose_context")?.loseContext();
}
