/**
 * The chart under the slider: bytes and decode time of every frame, the buffered range, and the current frame.
 *
 * The height of a bar is proportional to the square root of the bytes. Otherwise, frames with many births would make the
 * bars of all other frames invisible.
 */

import { formatBytes } from "./format.js";

const EMPTY_COLOR = "#2b313a";
const BUFFERED_COLOR = "#5b6675";
const KNOWN_COLOR = "#3d4550";
const PLAYED_COLOR = "#6aa8ff";
const CANONICAL_COLOR = "#e6ebf2";
const DECODE_TIME_COLOR = "#ffb454";
const PLAYHEAD_COLOR = "#fff";

interface Bar {
  readonly bytes: number | null;
  readonly decodeMs: number;
  readonly isCanonical: boolean;
}

/** The range of frames of a stream, and the position of playback. */
export interface TimelineExtent {
  readonly firstFrame: number;
  /** Ordinal after the last frame that is known. */
  readonly endFrame: number;
  readonly shownFrame: number;
  readonly bufferedTo: number;
  /** Duration of a frame, milliseconds; a decode time of this duration has the full height. */
  readonly frameMs: number;
}

export class Timeline {
  readonly #canvas: HTMLCanvasElement;
  readonly #bars = new Map<number, Bar>();
  #maxBytes = 1;

  constructor(canvas: HTMLCanvasElement) {
    this.#canvas = canvas;
  }

  clear(): void {
    this.#bars.clear();
    this.#maxBytes = 1;
  }

  /** Add a frame. Canonical frames have full height and do not affect the scale of the other bars. */
  add(frame: number, { bytes, decodeMs, isCanonical }: Bar): void {
    const knownBytes = this.#bars.get(frame)?.bytes ?? null;
    this.#bars.set(frame, { bytes: bytes ?? knownBytes, decodeMs, isCanonical });
    if (!isCanonical) this.#maxBytes = Math.max(this.#maxBytes, bytes ?? 0);
  }

  /** Describe a frame, for the tooltip of the slider. */
  describe(frame: number): string {
    const bar = this.#bars.get(frame);
    if (bar === undefined) return `frame ${frame}`;
    const kind = bar.isCanonical ? ", canonical" : "";
    return `frame ${frame} · ${formatBytes(bar.bytes)}${kind} · decoded in ${bar.decodeMs.toFixed(1)} ms`;
  }

  draw(extent: TimelineExtent): void {
    const { clientWidth, clientHeight } = this.#canvas;
    const width = Math.round(clientWidth * devicePixelRatio);
    const height = Math.round(clientHeight * devicePixelRatio);
    if (this.#canvas.width !== width) this.#canvas.width = width;
    if (this.#canvas.height !== height) this.#canvas.height = height;
    const context = this.#canvas.getContext("2d");
    if (context === null) return;
    context.clearRect(0, 0, width, height);
    const frameCount = extent.endFrame - extent.firstFrame;
    if (frameCount <= 0 || width === 0) return; // the width is 0 while the timeline is hidden
    const frameWidth = width / frameCount;
    const framesPerBar = Math.max(1, Math.floor(1 / frameWidth)); // frames per pixel
    const largestBars = this.#findLargestBars(extent.firstFrame, framesPerBar);
    for (let frame = extent.firstFrame; frame < extent.endFrame; frame += framesPerBar) {
      this.#drawBar(context, frame, largestBars.get(frame), extent, frameWidth * framesPerBar, height);
    }
    const playheadX = (extent.shownFrame - extent.firstFrame + 0.5) * frameWidth;
    context.fillStyle = PLAYHEAD_COLOR;
    context.fillRect(playheadX - devicePixelRatio, 0, 2 * devicePixelRatio, height);
  }

  #drawBar(
    context: CanvasRenderingContext2D,
    frame: number,
    bar: Bar | undefined,
    extent: TimelineExtent,
    barPitch: number,
    height: number,
  ): void {
    const left = ((frame - extent.firstFrame) * this.#canvas.width) / (extent.endFrame - extent.firstFrame);
    const width = Math.max(1, barPitch - (barPitch > 4 ? devicePixelRatio : 0));
    const barHeight = Math.max(2 * devicePixelRatio, this.#barHeight(bar) * height);
    context.fillStyle = chooseColor(frame, bar, extent);
    context.fillRect(left, height - barHeight, width, barHeight);
    if (bar === undefined) return;
    const timeHeight = Math.min(1, bar.decodeMs / extent.frameMs) * (height - devicePixelRatio);
    context.fillStyle = DECODE_TIME_COLOR;
    context.fillRect(left, height - timeHeight - devicePixelRatio, width, devicePixelRatio);
  }

  /** Find the largest bar of each group of consecutive frames that share a pixel, by the first frame of the group. */
  #findLargestBars(firstFrame: number, framesPerBar: number): ReadonlyMap<number, Bar> {
    const largestBars = new Map<number, Bar>();
    for (const [frame, bar] of this.#bars) { // not all ordinals: an index may claim billions of frames
      const groupFrame = frame - ((frame - firstFrame) % framesPerBar);
      const largest = largestBars.get(groupFrame);
      if (largest === undefined || (bar.bytes ?? 0) > (largest.bytes ?? 0)) largestBars.set(groupFrame, bar);
    }
    return largestBars;
  }

  #barHeight(bar: Bar | undefined): number {
    if (bar === undefined) return 0;
    return bar.isCanonical ? 1 : 0.85 * Math.sqrt(Math.min(1, (bar.bytes ?? 0) / this.#maxBytes));
  }
}

function chooseColor(frame: number, bar: Bar | undefined, { shownFrame, bufferedTo }: TimelineExtent): string {
  if (bar?.isCanonical === true) return CANONICAL_COLOR;
  if (frame <= shownFrame) return PLAYED_COLOR;
  if (frame < bufferedTo) return BUFFERED_COLOR;
  return bar === undefined ? EMPTY_COLOR : KNOWN_COLOR;
}
