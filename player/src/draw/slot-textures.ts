/**
 * The state of all slots in textures of integers, as in the stream.
 *
 * The changes of a frame are uploaded as vertices, one per slot, and each is drawn as a point of one pixel into all
 * textures at once. The cost of a frame thus depends on what it changes, not on which slots these are.
 */

import type { FramePacket } from "../protocol.js";
import { buildProgram, DrawingError } from "./programs.js";

/** Slots per row of the textures: 2 ** ROW_BITS. */
export const ROW_BITS = 11;
const ROW = 1 << ROW_BITS;
const ROWS_AT_FIRST = 8;

/** Textures that are written together: every slot has a texel in each of them. */
interface Layer {
  readonly format: GLenum;
  readonly componentType: GLenum;
  readonly bytesPerComponent: number;
  /** Components of each texture that vertices supply; the others are 0 or 1. */
  readonly sizes: readonly number[];
  readonly program: WebGLProgram;
  readonly slotBuffer: WebGLBuffer;
  readonly valueBuffers: readonly WebGLBuffer[];
  readonly vertices: WebGLVertexArrayObject;
  textures: WebGLTexture[];
  framebuffer: WebGLFramebuffer | null;
}

export class SlotTextures {
  readonly #gl: WebGL2RenderingContext;
  readonly #moved: Layer;
  readonly #coded: Layer;
  #rows = 0;

  constructor(gl: WebGL2RenderingContext, shDegree: number) {
    this.#gl = gl;
    this.#moved = makeLayer(gl, gl.RGBA32I, gl.INT, [3, 4], true);
    this.#coded = makeLayer(gl, gl.RGBA16I, gl.SHORT, shDegree > 0 ? [4, 4, 4, 4] : [4, 3], false);
  }

  /** Positions, rotations, then the codes, four to a texture. */
  get textures(): readonly WebGLTexture[] {
    return [...this.#moved.textures, ...this.#coded.textures];
  }

  /** Upload the changes of a frame. */
  apply(packet: FramePacket): void {
    this.#reserve(packet.slotLimit, !packet.isFull);
    this.#write(this.#moved, packet.movedSlots, [packet.positions, packet.rotations]);
    this.#write(this.#coded, packet.codedSlots, [packet.codes]);
  }

  dispose(): void {
    const gl = this.#gl;
    for (const layer of [this.#moved, this.#coded]) {
      for (const texture of layer.textures) gl.deleteTexture(texture);
      for (const buffer of [layer.slotBuffer, ...layer.valueBuffers]) gl.deleteBuffer(buffer);
      gl.deleteFramebuffer(layer.framebuffer);
      gl.deleteVertexArray(layer.vertices);
      gl.deleteProgram(layer.program);
    }
  }

  #write(layer: Layer, slots: Uint32Array, values: readonly ArrayBufferView[]): void {
    if (slots.length === 0) return;
    const gl = this.#gl;
    upload(gl, layer.slotBuffer, slots);
    layer.valueBuffers.forEach((buffer, index) => {
      const value = values[index];
      if (value !== undefined) upload(gl, buffer, value);
    });
    gl.bindFramebuffer(gl.FRAMEBUFFER, layer.framebuffer);
    gl.viewport(0, 0, ROW, this.#rows);
    gl.disable(gl.BLEND);
    gl.disable(gl.SCISSOR_TEST);
    gl.useProgram(layer.program);
    gl.uniform1f(gl.getUniformLocation(layer.program, "rows"), this.#rows);
    gl.bindVertexArray(layer.vertices);
    gl.drawArrays(gl.POINTS, 0, slots.length);
    gl.bindVertexArray(null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  /** Grow the textures to a number of slots. */
  #reserve(slotLimit: number, isKept: boolean): void {
    const needed = Math.max(ROWS_AT_FIRST, Math.ceil(slotLimit / ROW));
    if (needed <= this.#rows) return;
    const most = this.#gl.getParameter(this.#gl.MAX_TEXTURE_SIZE) as number;
    if (needed > most) {
      throw new DrawingError(`${slotLimit} Gaussians exceed the limit of this graphics card`);
    }
    const rows = Math.min(most, Math.max(needed, Math.ceil(1.5 * this.#rows)));
    for (const layer of [this.#moved, this.#coded]) {
      enlarge(this.#gl, layer, rows, isKept ? this.#rows : 0);
    }
    this.#rows = rows;
  }
}

function makeLayer(
  gl: WebGL2RenderingContext,
  format: GLenum,
  componentType: GLenum,
  sizes: readonly number[],
  isApart: boolean,
): Layer {
  const slotBuffer = gl.createBuffer();
  const valueBuffers = isApart ? sizes.map(() => gl.createBuffer()) : [gl.createBuffer()];
  const bytesPerComponent = componentType === gl.INT ? 4 : 2;
  const layer: Layer = {
    format,
    componentType,
    bytesPerComponent,
    sizes,
    program: buildProgram(gl, ...writeShaders(sizes.length)),
    slotBuffer,
    valueBuffers,
    vertices: gl.createVertexArray(),
    textures: [],
    framebuffer: null,
  };
  describeVertices(gl, layer);
  return layer;
}

/** Describe the vertices of a layer: their slot and their values. */
function describeVertices(gl: WebGL2RenderingContext, layer: Layer): void {
  const total = layer.sizes.reduce((sum, size) => sum + size, 0);
  let before = 0;
  gl.bindVertexArray(layer.vertices);
  gl.bindBuffer(gl.ARRAY_BUFFER, layer.slotBuffer);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribIPointer(0, 1, gl.UNSIGNED_INT, 0, 0);
  layer.sizes.forEach((size, index) => {
    const isApart = layer.valueBuffers.length > 1;
    const stride = (isApart ? size : total) * layer.bytesPerComponent;
    const offset = isApart ? 0 : before * layer.bytesPerComponent;
    gl.bindBuffer(gl.ARRAY_BUFFER, layer.valueBuffers[isApart ? index : 0] ?? null);
    gl.enableVertexAttribArray(index + 1);
    gl.vertexAttribIPointer(index + 1, size, layer.componentType, stride, offset);
    before += size;
  });
  gl.bindVertexArray(null);
}

/** Give a layer textures with more rows; the first rows keep their contents. */
function enlarge(gl: WebGL2RenderingContext, layer: Layer, rows: number, keptRows: number): void {
  const framebuffer = gl.createFramebuffer();
  const textures = layer.sizes.map((_, index) => {
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, layer.format, ROW, rows);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    if (keptRows > 0) {
      gl.bindFramebuffer(gl.READ_FRAMEBUFFER, layer.framebuffer);
      gl.readBuffer(gl.COLOR_ATTACHMENT0 + index);
      gl.copyTexSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 0, 0, ROW, keptRows);
    }
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, framebuffer);
    const place = gl.COLOR_ATTACHMENT0 + index;
    gl.framebufferTexture2D(gl.DRAW_FRAMEBUFFER, place, gl.TEXTURE_2D, texture, 0);
    return texture;
  });
  gl.drawBuffers(textures.map((_, index) => gl.COLOR_ATTACHMENT0 + index));
  const isWhole = gl.checkFramebufferStatus(gl.DRAW_FRAMEBUFFER) === gl.FRAMEBUFFER_COMPLETE;
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  if (!isWhole && !gl.isContextLost()) {
    throw new DrawingError("this graphics card cannot draw into integer textures");
  }
  for (const texture of layer.textures) gl.deleteTexture(texture);
  gl.deleteFramebuffer(layer.framebuffer);
  layer.textures = textures;
  layer.framebuffer = framebuffer;
}

function upload(gl: WebGL2RenderingContext, buffer: WebGLBuffer, data: ArrayBufferView): void {
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ARRAY_BUFFER, data, gl.STREAM_DRAW);
}

/** Shaders that write the values of a vertex to the texels of its slot. */
function writeShaders(count: number): [string, string] {
  const each = (line: (index: number) => string): string =>
    Array.from({ length: count }, (_, index) => line(index)).join("\n");
  const vertex = `#version 300 es
precision highp float;
precision highp int;
uniform float rows;
layout(location = 0) in uint slot;
${each((i) => `layout(location = ${i + 1}) in ivec4 value${i}; flat out ivec4 kept${i};`)}
void main() {
  vec2 place = vec2(slot & ${ROW - 1}u, slot >> ${ROW_BITS}) + 0.5;
  gl_Position = vec4(2.0 * place / vec2(${ROW}.0, rows) - 1.0, 0.0, 1.0);
  gl_PointSize = 1.0;
${each((i) => `  kept${i} = value${i};`)}
}`;
  const fragment = `#version 300 es
precision highp float;
precision highp int;
${each((i) => `flat in ivec4 kept${i}; layout(location = ${i}) out ivec4 texel${i};`)}
void main() {
${each((i) => `  texel${i} = kept${i};`)}
}`;
  return [vertex, fragment];
}
