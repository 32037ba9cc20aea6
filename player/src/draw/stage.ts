/**
 * Shows frames on a canvas, with their Gaussians in sorted order.
 *
 * A frame is first sent to the sort worker. When the worker returns the order, the changes of the frame are uploaded and
 * the frame is drawn. Until then, the previous frame stays visible, even if the view changes.
 */

import type { Direction, FramePacket, SortReply, SortRequest, StreamInfo } from "../protocol.js";
import { eyeAxis, fitArea, resizeEye, widenEye, type Eye } from "./eye.js";
import { closeContext, Painter, type PlacedPicture } from "./painter.js";
import { takePicture, type PixelFormat } from "./picture.js";
import { DrawingError } from "./programs.js";
import { onScreenResize } from "./screen-size.js";

const MAX_PIXELS = 2560 * 1440;

/** Whether the canvas shows only the picture of an eye, or also its surroundings. */
export type Framing = "picture" | "wide";

/** The time to sort a frame and to upload its changes, milliseconds. */
export interface FrameCost {
  readonly sortMs: number;
  readonly uploadMs: number;
}

export interface StageEvents {
  onShown(packet: FramePacket, cost: FrameCost): void;
  /** The graphics context has been lost. */
  onLost(): void;
  /** The graphics context has been lost and restored. It is now empty, so a full packet is needed. */
  onRestored(): void;
  onFault(message: string): void;
}

/** Handles a reply of the sort worker; null if another stream or the end of the stage comes first. */
type HandleSortReply = (reply: SortReply | null) => void;

export class Stage {
  readonly #canvas: HTMLCanvasElement;
  readonly #gl: WebGL2RenderingContext;
  readonly #sorter: Worker;
  readonly #events: StageEvents;
  readonly #abortController = new AbortController();
  readonly #pendingRequests = new Map<number, HandleSortReply>();
  #lastToken = 0;
  #info: StreamInfo | null = null;
  #painter: Painter | null = null;
  #eye: Eye | null = null;
  #framing: Framing = "wide";
  #sortDirection: Direction | null = null;
  #pendingPacket: FramePacket | null = null;
  #order = new Uint32Array(0);
  #drawRequest = 0;
  #isInHeadset = false;
  #motionStart = 0;
  #motionMs = 0; // time in which Gaussians move to the current frame; 0 if they have

  constructor(canvas: HTMLCanvasElement, gl: WebGL2RenderingContext, startSorter: () => Worker, events: StageEvents) {
    this.#canvas = canvas;
    this.#gl = gl;
    this.#sorter = startSorter();
    this.#events = events;
    const { signal } = this.#abortController;
    this.#sorter.addEventListener("message", ({ data }) => this.#handleSortReply(data as SortReply), { signal });
    const reportFailure = ({ message }: ErrorEvent): void => events.onFault(message || "the sort worker could not be started");
    this.#sorter.addEventListener("error", reportFailure, { signal });
    canvas.addEventListener("webglcontextlost", (event) => this.#handleContextLost(event), { signal });
    canvas.addEventListener("webglcontextrestored", () => this.#handleContextRestored(), { signal });
    onScreenResize(canvas, () => this.#requestDrawing(), signal);
  }

  /** Whether a frame is being sorted. The next frame must not be shown before it is on the screen. */
  get isBusy(): boolean {
    return this.#pendingPacket !== null;
  }

  /** Prepare for a stream; the current picture stays on the screen until the first frame is shown. */
  begin(info: StreamInfo): void {
    this.#painter?.dispose();
    this.#painter = null; // the first packet creates another; a draw before it would clear the canvas
    this.#info = info;
    this.#pendingPacket = null;
    this.#dropRequests();
    this.#sortDirection = null;
  }

  /** Use cameras that come after the beginning of a stream. */
  update(info: StreamInfo): void {
    this.#info = info;
    if (this.#painter !== null) this.#painter.captureCameras = info.cameras;
    this.#requestDrawing();
  }

  /**
   * Sort a frame, and then show it: its Gaussians move there from the previous frame in `motionMs`. A canonical frame has
   * other Gaussians than the frame before it, so it is shown at once.
   */
  show(packet: FramePacket, motionMs = 0): void {
    this.#pendingPacket = packet;
    const { isFull, slotLimit, movedSlots, positions, freedSlots } = packet;
    const sortPacket = { isFull, slotLimit, movedSlots, positions, freedSlots };
    const forward = this.#sortDirection = this.#viewDirection();
    this.#requestSort({ kind: "frame", packet: sortPacket, forward, token: this.#nextToken() }, (reply) => {
      if (reply === null) return;
      this.#pendingPacket = null;
      this.#apply(packet, reply, packet.isFull || packet.isCanonical ? 0 : motionMs);
    });
  }

  /** End the motion to the current frame, so that the frame is shown as it was decoded. */
  finishMotion(): void {
    this.#motionMs = 0;
    this.#requestDrawing();
  }

  /** Set the eye and the framing of the view. */
  setView(eye: Eye, framing: Framing): void {
    this.#eye = eye;
    this.#framing = framing;
    this.#requestDrawing();
    this.#sortIfViewTurned();
  }

  /** Return the graphics context, in which a headset can be drawn; the browser may first lose and restore it. */
  async openHeadsetContext(): Promise<WebGL2RenderingContext> {
    await this.#gl.makeXRCompatible();
    return this.#gl;
  }

  /** Draw the current frame for the eyes of the headset; it is sorted for the first. */
  paintHeadset(pictures: readonly PlacedPicture[], target: WebGLFramebuffer | null): void {
    this.#eye = pictures[0]?.eye ?? this.#eye;
    if (!this.#gl.isContextLost()) this.#paint(pictures, target);
    this.#sortIfViewTurned();
  }

  get isInHeadset(): boolean {
    return this.#isInHeadset;
  }

  /** Draw only in a headset, by `paintHeadset`, or on the canvas again. */
  set isInHeadset(isInHeadset: boolean) {
    this.#isInHeadset = isInHeadset;
    this.#requestDrawing();
  }

  /** Draw the current frame from an eye, off screen; see `Player.takePicture`. */
  takePicture(eye: Eye, format: PixelFormat): Promise<Float32Array> {
    return new Promise((resolve, reject) => {
      const draw: HandleSortReply = (reply) => {
        const painter = this.#painter;
        if (painter === null || reply === null) return reject(new DrawingError("no frame is shown"));
        painter.setOrder(reply.order);
        painter.progress = 1;
        try {
          resolve(takePicture(painter, eye, format));
        } catch (error) {
          reject(error as Error);
        }
        painter.setOrder(this.#order);
      };
      if (this.#abortController.signal.aborted) draw(null);
      else this.#requestSort({ kind: "view", forward: eyeAxis(eye, 2), token: this.#nextToken() }, draw);
    });
  }

  dispose(): void {
    if (this.#abortController.signal.aborted) return; // another player may have the canvas now
    this.#abortController.abort();
    cancelAnimationFrame(this.#drawRequest);
    this.#sorter.terminate();
    this.#dropRequests();
    this.#painter?.dispose();
    this.#painter = null; // so that nothing draws on the canvas any more
    closeContext(this.#canvas, this.#gl);
  }

  #requestSort(request: SortRequest, handleReply: HandleSortReply): void {
    this.#pendingRequests.set(request.token, handleReply);
    this.#sorter.postMessage(request);
  }

  #dropRequests(): void {
    for (const handleReply of this.#pendingRequests.values()) handleReply(null);
    this.#pendingRequests.clear();
  }

  #nextToken(): number {
    return ++this.#lastToken;
  }

  #handleSortReply(reply: SortReply): void {
    // Undefined if another stream has been opened since the request.
    const handleReply = this.#pendingRequests.get(reply.token);
    this.#pendingRequests.delete(reply.token);
    handleReply?.(reply);
    this.#sortIfViewTurned();
  }

  #apply(packet: FramePacket, { order, sortMs }: SortReply, motionMs: number): void {
    let startTime = 0;
    try {
      if (this.#info !== null && !this.#gl.isContextLost()) this.#painter ??= new Painter(this.#gl, this.#info);
      startTime = performance.now(); // after the compilation of the shaders, which is not part of an upload
      this.#painter?.apply(packet, motionMs > 0);
    } catch (error) {
      if (!(error instanceof DrawingError)) throw error;
      return this.#events.onFault(error.message);
    }
    [this.#motionStart, this.#motionMs] = [startTime, motionMs];
    this.#setOrder(order);
    this.#events.onShown(packet, { sortMs, uploadMs: performance.now() - startTime });
  }

  #setOrder(order: Uint32Array): void {
    this.#order = order as Uint32Array<ArrayBuffer>;
    this.#painter?.setOrder(order);
    this.#requestDrawing();
  }

  #sortIfViewTurned(): void {
    if (this.#pendingRequests.size > 0 || this.#painter === null || this.#sortDirection === null) return;
    const forward = this.#viewDirection();
    if (forward.every((value, axis) => value === this.#sortDirection?.[axis])) return;
    this.#sortDirection = forward;
    this.#requestSort({ kind: "view", forward, token: this.#nextToken() }, (reply) => {
      if (reply !== null) this.#setOrder(reply.order);
    });
  }

  #viewDirection(): Direction {
    return this.#eye === null ? [0, 0, 1] : eyeAxis(this.#eye, 2);
  }

  #requestDrawing(): void {
    if (this.#drawRequest === 0) this.#drawRequest = requestAnimationFrame(() => this.#draw());
  }

  #draw(): void {
    this.#drawRequest = 0;
    if (this.#painter === null || this.#eye === null || this.#isInHeadset || this.#gl.isContextLost()) return;
    this.#fitCanvas();
    this.#paint([this.#placePicture(this.#eye)]);
    if (this.#painter.progress < 1) this.#requestDrawing();
  }

  #paint(pictures: readonly PlacedPicture[], target: WebGLFramebuffer | null = null): void {
    if (this.#painter === null) return;
    const isMoving = this.#motionMs > 0;
    this.#painter.progress = isMoving ? Math.min(1, (performance.now() - this.#motionStart) / this.#motionMs) : 1;
    this.#painter.paint(pictures, target);
  }

  #placePicture(eye: Eye): PlacedPicture {
    const { width, height } = this.#canvas;
    if (this.#framing === "wide") return { eye: widenEye(eye, width, height), viewport: { x: 0, y: 0, width, height } };
    const { left, top, ...size } = fitArea(eye, width, height);
    const viewport = { x: left, y: height - top - size.height, ...size };
    return { eye: resizeEye(eye, size.width, size.height), viewport };
  }

  /**
   * Give the canvas the resolution of the screen, but at most MAX_PIXELS pixels. A canvas that is not on the page, such as
   * the image of a texture, keeps its resolution.
   */
  #fitCanvas(): void {
    const canvas = this.#canvas;
    if (!canvas.isConnected) return;
    const { clientWidth, clientHeight } = canvas;
    const maxScale = Math.sqrt(MAX_PIXELS / Math.max(1, clientWidth * clientHeight));
    const scale = Math.min(devicePixelRatio, maxScale);
    const width = Math.max(1, Math.round(clientWidth * scale));
    const height = Math.max(1, Math.round(clientHeight * scale));
    if (canvas.width === width && canvas.height === height) return;
    Object.assign(canvas, { width, height });
    // If the page gives the canvas no size, its attributes have just changed its size; without this, it would grow or shrink on.
    if (Math.abs(canvas.clientWidth - clientWidth) > 1) canvas.style.width = `${clientWidth}px`;
    if (Math.abs(canvas.clientHeight - clientHeight) > 1) canvas.style.height = `${clientHeight}px`;
  }

  #handleContextLost(event: Event): void {
    event.preventDefault(); // otherwise the browser does not restore the context
    this.#painter = null;
    this.#events.onLost();
  }

  #handleContextRestored(): void {
    if (this.#info === null) return;
    this.begin(this.#info);
    this.#events.onRestored();
  }
}
