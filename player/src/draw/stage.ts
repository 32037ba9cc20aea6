/**
 * A canvas on which frames are shown, each in its own order.
 *
 * A frame goes to the sort worker first; what it changes is taken over, and drawn, when its order
 * has come. Until then the frame before stays as it is, from wherever it is looked at.
 */

import type { FramePacket, PartialScene, SortReply, SortRequest, StreamInfo } from "../protocol.js";
import { axisOf, fitArea, resizeEye, widenEye, type Area, type Eye, type Vector } from "./eye.js";
import { openContext, Painter } from "./painter.js";
import { DrawingError } from "./programs.js";
import { takePicture, type Depth } from "./picture.js";

/** The ordinal of what is no frame of the stream yet. */
export const NO_FRAME = -1;

const MOST_PIXELS = 2560 * 1440;

/** How an eye's picture lies on the canvas: alone, or with all that is around it. */
export type Framing = "picture" | "wide";

/** What a stage tells. */
export interface StageEvents {
  onShown(packet: FramePacket, sortMs: number): void;
  /** The graphics card has forgotten everything: a full packet is needed. */
  onForgotten(): void;
  /** It has not got room for a frame, say. */
  onFault(message: string): void;
}

export class Stage {
  readonly #canvas: HTMLCanvasElement;
  readonly #gl: WebGL2RenderingContext;
  readonly #sorter: Worker;
  readonly #events: StageEvents;
  readonly #ended = new AbortController();
  readonly #resized: ResizeObserver;
  #info: StreamInfo | null = null;
  #painter: Painter | null = null;
  #eye: Eye | null = null;
  #framing: Framing = "wide";
  #sortedFor: Vector | null = null;
  #coming: FramePacket | null = null;
  #shown: FramePacket | null = null;
  #asked = 0;
  #drawing = 0;

  constructor(canvas: HTMLCanvasElement, sorter: Worker, events: StageEvents) {
    this.#canvas = canvas;
    this.#gl = openContext(canvas);
    this.#sorter = sorter;
    this.#events = events;
    const { signal } = this.#ended;
    sorter.addEventListener("message", ({ data }) => this.#takeOrder(data as SortReply), { signal });
    canvas.addEventListener("webglcontextlost", (event) => this.#forget(event), { signal });
    canvas.addEventListener("webglcontextrestored", () => this.#remember(), { signal });
    this.#resized = new ResizeObserver(() => this.#requestDrawing());
    this.#resized.observe(canvas);
  }

  /** Whether a frame waits for its order; the next one may come when it is shown. */
  get isBusy(): boolean {
    return this.#coming !== null;
  }

  /** Prepare for a stream. */
  begin(info: StreamInfo): void {
    this.#painter?.dispose();
    this.#info = info;
    this.#coming = this.#shown = null;
    this.#painter = new Painter(this.#gl, info);
  }

  /** Show a frame as soon as it is sorted. */
  show(packet: FramePacket): void {
    this.#coming = packet;
    const { frame, run, isFull, slotLimit, movedSlots, positions, freedSlots } = packet;
    const part = { frame, run, isFull, slotLimit, movedSlots, positions, freedSlots };
    this.#ask({ kind: "frame", packet: part, forward: this.#forward() });
  }

  /** Show what there is of a frame that is still on its way. */
  showPartial(scene: PartialScene): void {
    if (this.#info !== null) this.show(completePartial(scene, this.#info));
  }

  /** Look from somewhere else. */
  look(eye: Eye, framing: Framing): void {
    this.#eye = eye;
    this.#framing = framing;
    this.#requestDrawing();
    this.#sortIfTurned();
  }

  /** The eye as it is on the canvas, its numbers in pixels there. */
  get shownEye(): Eye | null {
    return this.#eye === null ? null : this.#lay(this.#eye)[0];
  }

  /** Draw what an eye sees, now and apart from the canvas; in the order of the last direction. */
  takePicture(eye: Eye, depth: Depth): Float32Array | null {
    return this.#painter === null ? null : takePicture(this.#painter, eye, depth);
  }

  dispose(): void {
    this.#ended.abort();
    this.#resized.disconnect();
    cancelAnimationFrame(this.#drawing);
    this.#sorter.terminate();
    this.#painter?.dispose();
    this.#gl.getExtension("WEBGL_lose_context")?.loseContext();
  }

  #takeOrder(reply: SortReply): void {
    this.#asked -= 1;
    const isOf = (packet: FramePacket | null): packet is FramePacket =>
      packet?.frame === reply.frame && packet.run === reply.run;
    const packet = this.#coming;
    if (isOf(packet)) {
      this.#coming = null;
      this.#shown = packet;
      this.#apply(packet);
    }
    if (isOf(this.#shown)) { // else a seek has passed over the frame
      this.#painter?.setOrder(reply.order);
      this.#requestDrawing();
    }
    if (isOf(packet)) this.#events.onShown(packet, reply.sortMs);
    this.#sortIfTurned();
  }

  #apply(packet: FramePacket): void {
    try {
      this.#painter?.apply(packet);
    } catch (error) {
      if (!(error instanceof DrawingError)) throw error;
      this.#events.onFault(error.message);
    }
  }

  #sortIfTurned(): void {
    if (this.#asked > 0 || this.#painter === null || this.#sortedFor === null) return;
    const forward = this.#forward();
    if (forward.some((value, k) => value !== this.#sortedFor?.[k])) this.#ask({ kind: "view", forward });
  }

  #ask(request: Exclude<SortRequest, { kind: "close" }>): void {
    this.#asked += 1;
    this.#sortedFor = request.forward;
    this.#sorter.postMessage(request);
  }

  #forward(): Vector {
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

  /** Have a pixel of the canvas for each of the screen, but no more than a card is quick with. */
  #fitCanvas(): void {
    const { clientWidth, clientHeight } = this.#canvas;
    const most = Math.sqrt(MOST_PIXELS / Math.max(1, clientWidth * clientHeight));
    const scale = Math.min(devicePixelRatio, most);
    const width = Math.max(1, Math.round(clientWidth * scale));
    const height = Math.max(1, Math.round(clientHeight * scale));
    if (this.#canvas.width !== width) this.#canvas.width = width;
    if (this.#canvas.height !== height) this.#canvas.height = height;
  }

  #forget(event: Event): void {
    event.preventDefault(); // else it is not given back
    this.#painter = null;
  }

  #remember(): void {
    if (this.#info === null) return;
    this.begin(this.#info);
    this.#events.onForgotten();
  }
}

/** A partial scene as a packet: nothing turned, the same from all sides. */
function completePartial(scene: PartialScene, info: StreamInfo): FramePacket {
  const count = scene.positions.length / 3;
  const width = info.shDegree > 0 ? 16 : 7;
  const slots = Uint32Array.from({ length: count }, (_, slot) => slot);
  const rotations = new Int32Array(4 * count);
  const codes = new Int16Array(width * count);
  for (let slot = 0; slot < count; slot++) {
    rotations[4 * slot] = 1 << 22;
    codes.set(scene.codes.subarray(7 * slot, 7 * slot + 7), width * slot);
  }
  return {
    frame: NO_FRAME,
    run: scene.run,
    isFull: true,
    count,
    slotLimit: count,
    movedSlots: slots,
    positions: scene.positions,
    rotations,
    codedSlots: slots,
    codes,
    freedSlots: new Uint32Array(0),
    bytes: 0,
    decodeMs: 0,
    isCanonical: true,
  };
}
