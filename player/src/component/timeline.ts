/**
 * The chart under the slider: bytes and decode time of every frame, the buffered range, the current frame.
 *
 * The height of a bar is the square root of the bytes, because frames with many births would otherwise make all others
 * invisible.
 */

import { formatBytes } from "./format.js";

const EMPTY = "#2b313a";
const BUFFERED = "#5b6675";
const KNOWN = "#3d4550";
const PASSED = "#6aa8ff";
const CANONICAL = "#e6ebf2";
const DECODE_TIME = "#ffb454";
const PLAYHEAD = "#fff";

interface Bar {
  readonly bytes: number | null;
  readonly decodeMs: number;
  readonly isCanonical: boolean;
}

/** The extent of a stream, and the position of playback. */
export interface Extent {
  readonly first: number;
  /** Ordinal after the last known frame. */
  readonly end: number;
  readonly shown: number;
  readonly bufferedTo: number;
  /** Duration of a frame, milliseconds: the full height for decode times. */
  readonly frameMs: number;
}

export class Timeline {
  readonly #canvas: HTMLCanvasElement;
  readonly #bars = new Map<number, Bar>();
  #tallest = 1;

  constructor(canvas: HTMLCanvasElement) {
    this.#canvas = canvas;
  }

  clear(): void {
    this.#bars.clear();
    this.#tallest = 1;
  }

  /** Add a frame. Canonical frames have full height; the scale is that of the others. */
  add(frame: number, { bytes, decodeMs, isCanonical }: Bar): void {
    const known = this.#bars.get(frame)?.bytes ?? null;
    this.#bars.set(frame, { bytes: bytes ?? known, decodeMs, isCanonical });
    if (!isCanonical) this.#tallest = Math.max(this.#tallest, bytes ?? 0);
  }

  /** The description of a frame, shown when the pointer is over it. */
  describe(frame: number): string {
    const bar = this.#bars.get(frame);
    if (bar === undefined) return `frame ${frame}`;
    const kind = bar.isCanonical ? ", canonical" : "";
    return `frame ${frame} · ${formatBytes(bar.bytes)}${kind} · decoded in ${bar.decodeMs.toFixed(1)} ms`;
  }

  draw(extent: Extent): void {
    const { clientWidth, clientHeight } = this.#canvas;
    const width = Math.round(clientWidth * devicePixelRatio);
    const height = Math.round(clientHeight * devicePixelRatio);
    if (this.#canvas.width !== width) this.#canvas.width = width;
    if (this.#canvas.height !== height) this.#canvas.height = height;
    const context = this.#canvas.getContext("2d");
    if (context === null) return;
    context.clearRect(0, 0, width, height);
    const count = extent.end - extent.first;
    if (count <= 0) return;
    const pitch = width / count;
    const step = Math.max(1, Math.floor(1 / pitch)); // frames per pixel
    for (let frame = extent.first; frame < extent.end; frame += step) {
      this.#drawBar(context, frame, this.#find(frame, step), extent, pitch * step, height);
    }
    const at = (extent.shown - extent.first + 0.5) * pitch;
    context.fillStyle = PLAYHEAD;
    context.fillRect(at - devicePixelRatio, 0, 2 * devicePixelRatio, height);
  }

  #drawBar(
    context: CanvasRenderingContext2D,
    frame: number,
    bar: Bar | undefined,
    extent: Extent,
    pitch: number,
    height: number,
  ): void {
    const left = ((frame - extent.first) * this.#canvas.width) / (extent.end - extent.first);
    const width = Math.max(1, pitch - (pitch > 4 ? devicePixelRatio : 0));
    const tall = Math.max(2 * devicePixelRatio, this.#heightOf(bar) * height);
    context.fillStyle = colorOf(frame, bar, extent);
    context.fillRect(left, height - tall, width, tall);
    if (bar === undefined) return;
    const time = Math.min(1, bar.decodeMs / extent.frameMs) * (height - devicePixelRatio);
    context.fillStyle = DECODE_TIME;
    context.fillRect(left, height - time - devicePixelRatio, width, devicePixelRatio);
  }

  /** The bar of a pixel: a canonical frame if there is one, else the largest. */
  #find(frame: number, step: number): Bar | undefined {
    let found = this.#bars.get(frame);
    for (let other = frame + 1; other < frame + step; other++) {
      const bar = this.#bars.get(other);
      if (bar !== undefined && (found === undefined || (bar.bytes ?? 0) > (found.bytes ?? 0))) found = bar;
    }
    return found;
  }

  #heightOf(bar: Bar | undefined): number {
    if (bar === undefined) return 0;
    return bar.isCanonical ? 1 : 0.85 * Math.sqrt(Math.min(1, (bar.bytes ?? 0) / this.#tallest));
  }
}

function colorOf(frame: number, bar: Bar | undefined, { shown, bufferedTo }: Extent): string {
  if (bar?.isCanonical === true) return CANONICAL;
  if (frame <= shown) return PASSED;
  if (frame < bufferedTo) return BUFFERED;
  return bar === undefined ? EMPTY : KNOWN;
}
