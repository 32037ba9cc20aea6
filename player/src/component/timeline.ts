/**
 * The bytes of every frame, drawn under the slider: what is decoded, what is shown.
 *
 * Bars are as high as the root of the bytes: frames of births would leave nothing to see of the
 * others.
 */

const EMPTY = "#2b313a";
const DECODED = "#4a5462";
const PASSED = "#6aa8ff";
const CANONICAL = "#e6ebf2";

interface Bar {
  readonly bytes: number;
  readonly isCanonical: boolean;
}

/** What of a stream is where. */
export interface Place {
  readonly first: number;
  /** Ordinal after the last frame that is known of. */
  readonly end: number;
  readonly shown: number;
  readonly bufferedTo: number;
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

  /** Take note of a frame's bytes. Canonical ones are larger than all others: the scale is of those. */
  add(frame: number, bytes: number, isCanonical: boolean): void {
    this.#bars.set(frame, { bytes, isCanonical });
    if (!isCanonical) this.#tallest = Math.max(this.#tallest, bytes);
  }

  draw(place: Place): void {
    const { clientWidth, clientHeight } = this.#canvas;
    const width = Math.round(clientWidth * devicePixelRatio);
    const height = Math.round(clientHeight * devicePixelRatio);
    this.#canvas.width = width; // which also clears
    this.#canvas.height = height;
    const context = this.#canvas.getContext("2d");
    const count = place.end - place.first;
    if (context === null || count <= 0) return;
    const pitch = width / count;
    const gap = pitch > 4 ? devicePixelRatio : 0;
    for (let frame = place.first; frame < place.end; frame++) {
      const bar = this.#bars.get(frame);
      const tall = Math.max(2, this.#heightOf(bar) * (height - 4));
      context.fillStyle = colorOf(frame, bar, place);
      context.fillRect((frame - place.first) * pitch, height - tall, Math.max(1, pitch - gap), tall);
    }
    const at = (place.shown - place.first + 0.5) * pitch;
    context.fillStyle = "#fff";
    context.fillRect(at - devicePixelRatio, 0, 2 * devicePixelRatio, height);
  }

  #heightOf(bar: Bar | undefined): number {
    if (bar === undefined) return 0;
    return bar.isCanonical ? 1 : 0.9 * Math.sqrt(Math.min(1, bar.bytes / this.#tallest));
  }
}

function colorOf(frame: number, bar: Bar | undefined, { shown, bufferedTo }: Place): string {
  if (bar?.isCanonical === true) return CANONICAL;
  if (frame <= shown) return PASSED;
  return frame < bufferedTo || bar !== undefined ? DECODED : EMPTY;
}
