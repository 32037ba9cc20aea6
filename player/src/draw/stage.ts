/**
 * A canvas that shows frames with their sorted order.
 *
 * A frame is first sent to the sort worker. When its order is back, its changes are uploaded and it is drawn; until
 * then, the previous frame stays visible, even if the view changes.
 */

import type { Direction, FramePacket, SortReply, SortRequest, StreamInfo } from "../protocol.js";
import { axisOf, fitArea, resizeEye, widenEye, type Area, type Eye } from "./eye.js";
import { openContext, Painter } from "./painter.js";
import { takePicture, type Depth } from "./picture.js";
import { DrawingError } from "./programs.js";

const MOST_PIXELS = 2560 * 1440;

/** Whether to show only an eye's picture, or everything around it, too. */
export type Framing = "picture" | "wide";

/** The time to bring a frame onto the screen, milliseconds. */
export interface FrameCost {
  readonly sortMs: number;
  readonly uploadMs: number;
}

export interface StageEvents {
  onShown(packet: FramePacket, cost: FrameCost): void;
  /** The graphics context was lost and restored, but is empty: a full packet is needed. */
  onRestored(): void;
  onFault(message: string): void;
}

/** What to do with an order when the sort worker returns it. */
type Receive = (reply: SortReply) => void;

export class Stage {
  readonly #canvas: HTMLCanvasElement;
  readonly #gl: WebGL2RenderingContext;
  readonly #sorter: Worker;
  readonly #events: StageEvents;
  readonly #ended = new AbortController();
  readonly #resized: ResizeObserver;
  readonly #asked = new Map<number, Receive>();
  #lastToken = 0;
  #info: StreamInfo | null = null;
  #painter: Painter | null = null;
  #eye: Eye | null = null;
  #framing: Framing = "wide";
  #sortedFor: Direction | null = null;
  #coming: FramePacket | null = null;
  #order = new Uint32Array(0);
  #drawing = 0;

  constructor(canvas: HTMLCanvasElement, sorter: Worker, events: StageEvents) {
    this.#canvas = canvas;
    this.#gl = openContext(canvas);
    this.#sorter = sorter;
    this.#events = events;
    const { signal } = this.#ended;
    sorter.addEventListener("message", ({ data }) => this.#receive(data as SortReply), { signal });
    canvas.addEventListener("webglcontextlost", (event) => this.#lose(event), { signal });
    canvas.addEventListener("webglcontextrestored", () => this.#restore(), { signal });
    this.#resized = new ResizeObserver(() => this.#requestDrawing());
    this.#resized.observe(canvas);
  }

  /** Whether a frame is being sorted; the next one can be shown when it is on the screen. */
  get isBusy(): boolean {
    return this.#coming !== null;
  }

  /** Prepare for a stream; the last picture stays until the first frame is shown. */
  begin(info: StreamInfo): void {
    this.#painter?.dispose();
    this.#info = info;
    this.#coming = null;
    this.#asked.clear();
    this.#sortedFor = null;
    this.#painter = new Painter(this.#gl, info);
  }

  /** Show a frame as soon as it is sorted. */
  show(packet: FramePacket): void {
    this.#coming = packet;
    const { isFull, slotLimit, movedSlots, positions, freedSlots } = packet;
    const part = { isFull, slotLimit, movedSlots, positions, freedSlots };
    const forward = this.#sortedFor = this.#forward();
    this.#ask({ kind: "frame", packet: part, forward, token: this.#nextToken() }, (reply) => {
      this.#coming = null;
      this.#apply(packet, reply);
    });
  }

  /** Set the view. */
  look(eye: Eye, framing: Framing): void {
    this.#eye = eye;
    this.#framing = framing;
    this.#requestDrawing();
    this.#sortIfTurned();
  }

  /** The eye as drawn on the canvas, in pixels of the canvas. */
  get shownEye(): Eye | null {
    return this.#eye === null ? null : this.#lay(this.#eye)[0];
  }

  /** Draw what an eye sees of the current frame, off screen. */
  takePicture(eye: Eye, depth: Depth): Promise<Float32Array> {
    return new Promise((resolve, reject) => {
      const draw = ({ order }: SortReply): void => {
        const painter = this.#painter;
        if (painter === null) return reject(new DrawingError("no frame is shown"));
        painter.setOrder(order);
        try {
          resolve(takePicture(painter, eye, depth));
        } catch (error) {
          reject(error as Error);
        }
        painter.setOrder(this.#order);
      };
      this.#ask({ kind: "view", forward: axisOf(eye, 2), token: this.#nextToken() }, draw);
    });
  }

  dispose(): void {
    this.#ended.abort();
    this.#resized.disconnect();
    cancelAnimationFrame(this.#drawing);
    this.#sorter.terminate();
    this.#painter?.dispose();
    this.#gl.getExtension("WEBGL_lose_context")?.loseContext();
  }

  #ask(request: SortRequest, receive: Receive): void {
    this.#asked.set(request.token, receive);
    this.#sorter.postMessage(request);
  }

  #nextToken(): number {
    return ++this.#lastToken;
  }

  #receive(reply: SortReply): void {
    const receive = this.#asked.get(reply.token); // none if the stream has changed since
    this.#asked.delete(reply.token);
    receive?.(reply);
    this.#sortIfTurned();
  }

  #apply(packet: FramePacket, { order, sortMs }: SortReply): void {
    const begun = performance.now();
    try {
      this.#painter?.apply(packet);
    } catch (error) {
      if (!(error instanceof DrawingError)) throw error;
      this.#events.onFault(error.message);
    }
    this.#setOrder(order);
    this.#events.onShown(packet, { sortMs, uploadMs: performance.now() - begun });
  }

  #setOrder(order: Uint32Array): void {
    this.#order = order as Uint32Array<ArrayBuffer>;
    this.#painter?.setOrder(order);
    this.#requestDrawing();
  }

  #sortIfTurned(): void {
    if (this.#asked.size > 0 || this.#painter === null || this.#sortedFor === null) return;
    const forward = this.#forward();
    if (forward.every((value, k) => value === this.#sortedFor?.[k])) return;
    this.#sortedFor = forward;
    this.#ask({ kind: "view", forward, token: this.#nextToken() }, ({ order }) => this.#setOrder(order));
  }

  #forward(): Direction {
    return this.#eye === null ? [0, 0, 1] : axisOf(this.#eye, 2);
  }

  #requestDrawing(): void {
    if (this.#drawing === 0) this.#drawing = requestAnimationFrame(() => this.#draw());
  }

  #draw(): void {
    this.#drawing = 0;
    if (this.#painter === null || this.#eye === null || this.#gl.isContextLost()) return;
    this.#fitCanvas();
    const [eye, area] = this.#lay(this.#eye);
    this.#painter.paint(eye, area, this.#canvas.height);
  }

  #lay(eye: Eye): [Eye, Area] {
    const { width, height } = this.#canvas;
    if (this.#framing === "wide") return [widenEye(eye, width, height), { left: 0, top: 0, width, height }];
    const area = fitArea(eye, width, height);
    return [resizeEye(eye, area.width, area.height), area];
  }

  /** Match the canvas to the pixels of the screen, up to what graphics cards draw quickly. */
  #fitCanvas(): void {
    const { clientWidth, clientHeight } = this.#canvas;
    const most = Math.sqrt(MOST_PIXELS / Math.max(1, clientWidth * clientHeight));
    const scale = Math.min(devicePixelRatio, most);
    const width = Math.max(1, Math.round(clientWidth * scale));
    const height = Math.max(1, Math.round(clientHeight * scale));
    if (this.#canvas.width !== width) this.#canvas.width = width;
    if (this.#canvas.height !== height) this.#canvas.height = height;
  }

  #lose(event: Event): void {
    event.preventDefault(); // otherwise it is not restored
    this.#painter = null;
  }

  #restore(): void {
    if (this.#info === null) return;
    this.begin(this.#info);
    this.#events.onRestored();
  }
}
