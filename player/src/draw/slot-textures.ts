/**
 * Stores the integer state of all slots in textures.
 *
 * The changes of a frame are uploaded as vertices, one vertex per slot. Each vertex is drawn as a point of one pixel into
 * all textures of a layer at once. So the cost of a frame depends on the number of changed slots, not on their order.
 */

import type { FramePacket } from "../protocol.js";
import { buildProgram, DrawingError } from "./programs.js";

/** Slots per row of the textures: 2 ** ROW_BITS. */
export const ROW_BITS = 11;
const ROW_SLOTS = 1 << ROW_BITS;
const INITIAL_ROWS = 8;
const OPACITY_COLUMN = 3; // of the codes
const TRANSPARENT = -0x8000; // the smallest code

/** Textures that are written together; every slot has a texel in each texture. */
interface Layer {
  readonly format: GLenum;
  readonly componentType: GLenum;
  readonly bytesPerComponent: number;
  /** Number of components of each texture that vertices supply; the other components are 0 or 1. */
  readonly componentCounts: readonly number[];
  readonly program: WebGLProgram;
  readonly slotBuffer: WebGLBuffer;
  readonly valueBuffers: readonly WebGLBuffer[];
  readonly vertices: WebGLVertexArrayObject;
  textures: WebGLTexture[];
  framebuffer: WebGLFramebuffer | null;
}

export class SlotTextures {
  readonly #gl: WebGL2RenderingContext;
  readonly #layers: readonly [Layer, Layer];
  /** The layers of the previous frame; they have their own textures and framebuffers. Empty until they are needed. */
  #previousLayers: readonly Layer[] = [];
  #rowCount = 0;

  constructor(gl: WebGL2RenderingContext, shDegree: number) {
    this.#gl = gl;
    const motionLayer = makeLayer(gl, gl.RGBA32I, gl.INT, [3, 4], true);
    const codeLayer = makeLayer(gl, gl.RGBA16I, gl.SHORT, shDegree > 0 ? [4, 4, 4, 4] : [4, 3], false);
    this.#layers = [motionLayer, codeLayer];
  }

  /**
   * The textures of positions, of rotations, and of the codes, which have four codes each; then those of the previous
   * frame, in the same order.
   */
  get textures(): readonly WebGLTexture[] {
    const previousLayers = this.#previousLayers.length > 0 ? this.#previousLayers : this.#layers;
    return [...this.#layers, ...previousLayers].flatMap((layer) => layer.textures);
  }

  /** Upload the changes of a frame. With `keepsPrevious`, keep the values of the previous frame as well. */
  apply(packet: FramePacket, keepsPrevious: boolean): void {
    const { slotLimit, isFull, movedSlots, positions, rotations, codedSlots, codes } = packet;
    this.#reserve(slotLimit, !isFull);
    if (keepsPrevious) this.#keepPrevious(packet);
    this.#write(this.#layers[0], movedSlots, [positions, rotations]);
    this.#write(this.#layers[1], codedSlots, [codes]);
  }

  dispose(): void {
    const gl = this.#gl;
    for (const layer of this.#layers) {
      for (const buffer of [layer.slotBuffer, ...layer.valueBuffers]) gl.deleteBuffer(buffer);
      gl.deleteVertexArray(layer.vertices);
      gl.deleteProgram(layer.program);
    }
    for (const layer of [...this.#layers, ...this.#previousLayers]) deleteTextures(gl, layer);
  }

  /** Copy all values to the previous layers; births are transparent there, and otherwise as in the frame. */
  #keepPrevious({ bornSlots, movedSlots, positions, rotations, codedSlots, codes }: FramePacket): void {
    if (this.#previousLayers.length === 0) {
      this.#previousLayers = this.#layers.map((layer) => ({ ...layer, textures: [], framebuffer: null }));
      for (const layer of this.#previousLayers) enlarge(this.#gl, layer, this.#rowCount, 0);
    }
    this.#layers.forEach((layer, index) => {
      const { textures } = this.#previousLayers[index] as Layer;
      textures.forEach((texture, number) => copyRows(this.#gl, layer, number, texture, this.#rowCount));
    });
    const [motionLayer, codeLayer] = this.#previousLayers as [Layer, Layer];
    const movedRows = findRows(movedSlots, bornSlots);
    this.#write(motionLayer, bornSlots, [gatherRows(positions, 3, movedRows), gatherRows(rotations, 4, movedRows)]);
    const width = codes.length / Math.max(1, codedSlots.length);
    const bornCodes = gatherRows(codes, width, findRows(codedSlots, bornSlots));
    for (let index = OPACITY_COLUMN; index < bornCodes.length; index += width) bornCodes[index] = TRANSPARENT;
    this.#write(codeLayer, bornSlots, [bornCodes]);
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
    gl.viewport(0, 0, ROW_SLOTS, this.#rowCount);
    gl.disable(gl.BLEND);
    gl.disable(gl.SCISSOR_TEST);
    gl.useProgram(layer.program);
    gl.uniform1f(gl.getUniformLocation(layer.program, "rows"), this.#rowCount);
    gl.bindVertexArray(layer.vertices);
    gl.drawArrays(gl.POINTS, 0, slots.length);
    gl.bindVertexArray(null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  /** Grow the textures to at least `slotLimit` slots. */
  #reserve(slotLimit: number, keepsContents: boolean): void {
    const neededRows = Math.max(INITIAL_ROWS, Math.ceil(slotLimit / ROW_SLOTS));
    if (neededRows <= this.#rowCount) return;
    const maxRows = this.#gl.getParameter(this.#gl.MAX_TEXTURE_SIZE) as number;
    if (neededRows > maxRows) {
      throw new DrawingError(`the stream needs ${slotLimit} slots, more than this graphics card supports`);
    }
    const rows = Math.min(maxRows, Math.max(neededRows, Math.ceil(1.5 * this.#rowCount)));
    const copiedRows = keepsContents ? this.#rowCount : 0;
    for (const layer of [...this.#layers, ...this.#previousLayers]) enlarge(this.#gl, layer, rows, copiedRows);
    this.#rowCount = rows;
  }
}

function makeLayer(
  gl: WebGL2RenderingContext,
  format: GLenum,
  componentType: GLenum,
  componentCounts: readonly number[],
  hasSeparateBuffers: boolean,
): Layer {
  const slotBuffer = gl.createBuffer();
  const valueBuffers = hasSeparateBuffers ? componentCounts.map(() => gl.createBuffer()) : [gl.createBuffer()];
  const bytesPerComponent = componentType === gl.INT ? 4 : 2;
  const layer: Layer = {
    format,
    componentType,
    bytesPerComponent,
    componentCounts,
    program: buildProgram(gl, ...makeWriteShaders(componentCounts.length)),
    slotBuffer,
    valueBuffers,
    vertices: gl.createVertexArray(),
    textures: [],
    framebuffer: null,
  };
  describeVertices(gl, layer);
  return layer;
}

/** Set the vertex attributes of a layer: the slot, and the values for each texture. */
function describeVertices(gl: WebGL2RenderingContext, layer: Layer): void {
  const totalComponents = layer.componentCounts.reduce((sum, componentCount) => sum + componentCount, 0);
  let firstComponent = 0;
  gl.bindVertexArray(layer.vertices);
  gl.bindBuffer(gl.ARRAY_BUFFER, layer.slotBuffer);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribIPointer(0, 1, gl.UNSIGNED_INT, 0, 0);
  layer.componentCounts.forEach((componentCount, index) => {
    const hasSeparateBuffers = layer.valueBuffers.length > 1;
    const stride = (hasSeparateBuffers ? componentCount : totalComponents) * layer.bytesPerComponent;
    const offset = hasSeparateBuffers ? 0 : firstComponent * layer.bytesPerComponent;
    gl.bindBuffer(gl.ARRAY_BUFFER, layer.valueBuffers[hasSeparateBuffers ? index : 0] ?? null);
    gl.enableVertexAttribArray(index + 1);
    gl.vertexAttribIPointer(index + 1, componentCount, layer.componentType, stride, offset);
    firstComponent += componentCount;
  });
  gl.bindVertexArray(null);
}

/** Replace the textures of a layer by textures with more rows, and copy the first `copiedRows` rows. */
function enlarge(gl: WebGL2RenderingContext, layer: Layer, rows: number, copiedRows: number): void {
  const framebuffer = gl.createFramebuffer();
  const textures = layer.componentCounts.map((_, index) => {
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, layer.format, ROW_SLOTS, rows);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    if (copiedRows > 0) copyRows(gl, layer, index, texture, copiedRows);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, framebuffer);
    const attachment = gl.COLOR_ATTACHMENT0 + index;
    gl.framebufferTexture2D(gl.DRAW_FRAMEBUFFER, attachment, gl.TEXTURE_2D, texture, 0);
    return texture;
  });
  gl.drawBuffers(textures.map((_, index) => gl.COLOR_ATTACHMENT0 + index));
  const isComplete = gl.checkFramebufferStatus(gl.DRAW_FRAMEBUFFER) === gl.FRAMEBUFFER_COMPLETE;
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  if (!isComplete && !gl.isContextLost()) {
    throw new DrawingError("this graphics card cannot draw into integer textures");
  }
  deleteTextures(gl, layer);
  layer.textures = textures;
  layer.framebuffer = framebuffer;
}

function deleteTextures(gl: WebGL2RenderingContext, layer: Layer): void {
  for (const texture of layer.textures) gl.deleteTexture(texture);
  gl.deleteFramebuffer(layer.framebuffer);
}

/** Copy the first rows of a texture of a layer to another texture. */
function copyRows(gl: WebGL2RenderingContext, layer: Layer, index: number, texture: WebGLTexture, rows: number): void {
  gl.bindFramebuffer(gl.READ_FRAMEBUFFER, layer.framebuffer);
  gl.readBuffer(gl.COLOR_ATTACHMENT0 + index);
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.copyTexSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 0, 0, ROW_SLOTS, rows);
}

/** Return the index of each of some slots in a list that contains them; both lists are ascending. */
function findRows(slots: Uint32Array, someSlots: Uint32Array): Uint32Array {
  let row = 0;
  return someSlots.map((slot) => (row = slots.indexOf(slot, row)));
}

/** Return some rows of an array whose rows have `width` values. */
function gatherRows<T extends Int32Array | Int16Array>(values: T, width: number, rows: Uint32Array): T {
  const gathered = new (values.constructor as new (length: number) => T)(width * rows.length);
  rows.forEach((row, index) => gathered.set(values.subarray(width * row, width * (row + 1)), width * index));
  return gathered;
}

function upload(gl: WebGL2RenderingContext, buffer: WebGLBuffer, data: ArrayBufferView): void {
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ARRAY_BUFFER, data, gl.STREAM_DRAW);
}

/** Return the source of the shaders that write the values of a vertex to the texels of its slot. */
function makeWriteShaders(textureCount: number): [string, string] {
  const repeatLine = (line: (index: number) => string): string =>
    Array.from({ length: textureCount }, (_, index) => line(index)).join("\n");
  const vertex = `#version 300 es
precision highp float;
precision highp int;
uniform float rows;
layout(location = 0) in uint slot;
${repeatLine((i) => `layout(location = ${i + 1}) in ivec4 value${i}; flat out ivec4 value_${i};`)}
void main() {
  vec2 texel_center = vec2(slot & ${ROW_SLOTS - 1}u, slot >> ${ROW_BITS}) + 0.5;
  gl_Position = vec4(2.0 * texel_center / vec2(${ROW_SLOTS}.0, rows) - 1.0, 0.0, 1.0);
  gl_PointSize = 1.0;
${repeatLine((i) => `  value_${i} = value${i};`)}
}`;
  const fragment = `#version 300 es
precision highp float;
precision highp int;
${repeatLine((i) => `flat in ivec4 value_${i}; layout(location = ${i}) out ivec4 texel${i};`)}
void main() {
${repeatLine((i) => `  texel${i} = value_${i};`)}
}`;
  return [vertex, fragment];
}
