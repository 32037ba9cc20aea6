/**
 * `<quarc-player src="stream.quarc" poster="first.jpg" autoplay loop camera="cam00" speed="1" up="-y">`
 *
 * The events of `Player` are also dispatched on the element.
 */

import type { PixelFormat } from "../draw/picture.js";
import { DrawingError } from "../draw/programs.js";
import type { Player } from "../player.js";
import type { PlayerEvents } from "../player-events.js";
import type { StreamInfo, StreamSource } from "../protocol.js";
import type { Statistics } from "../statistics.js";
import { makeFault } from "../stream-error.js";
import { AXES } from "../view/scene.js";
import { connectControls } from "./buttons.js";
import { describeFault } from "./faults.js";
import { Session } from "./session.js";

export class QuarcPlayer extends HTMLElement {
  static readonly observedAttributes = ["src", "loop", "camera", "speed", "up", "audio", "audio-start", "muted"];

  readonly #root = this.attachShadow({ mode: "open" });
  #session: Session | null = null;
  #source: StreamSource | null = null;

  connectedCallback(): void {
    try {
      this.#session = new Session(this, this.#root);
      connectControls(this.#session, this.#root);
    } catch (error) {
      if (!(error instanceof DrawingError)) throw error;
      this.#showFault(error.message);
      return;
    }
    for (const name of ["loop", "speed", "up", "audio", "audio-start", "muted"]) this.attributeChangedCallback(name);
    this.#open();
  }

  disconnectedCallback(): void {
    this.#session?.dispose();
    this.#session = null;
    this.#root.replaceChildren();
  }

  attributeChangedCallback(name: string): void {
    const { player } = this;
    if (name === "src") this.#source = null;
    if (player === null) return;
    if (name === "src") this.#open();
    else if (name === "loop") player.loop = this.hasAttribute("loop");
    else if (name === "speed") player.speed = parseSpeed(this.getAttribute("speed"));
    else if (name === "up") player.up = AXES.find((axis) => axis === this.getAttribute("up")) ?? null;
    else if (name === "audio") player.audio = this.getAttribute("audio") || null; // like `src`
    else if (name === "audio-start") player.audioStart = Number(this.getAttribute("audio-start")) || 0;
    else if (name === "muted") player.muted = this.hasAttribute("muted");
    else if (name === "camera") player.camera = this.getAttribute("camera");
    this.#session?.refresh();
  }

  /** The player of the element; null while the element is not in a document. */
  get player(): Player | null {
    return this.#session?.player ?? null;
  }

  /** Open a stream instead of `src`: a buffer, an address with request headers, or a live stream. */
  open(source: StreamSource): void {
    this.#source = source;
    this.#open();
  }

  play(): void {
    this.player?.play();
  }

  pause(): void {
    this.player?.pause();
  }

  /** Seek to a time, in seconds from the first frame. Resolves and rejects like `Player.setFrame`. */
  seek(seconds: number): Promise<number | null> {
    return this.player?.seek(seconds) ?? Promise.resolve(null);
  }

  /** Seek to a frame by its ordinal. Resolves and rejects like `Player.setFrame`. */
  setFrame(frame: number): Promise<number | null> {
    return this.player?.setFrame(frame) ?? Promise.resolve(null);
  }

  /** Pause, and move by `count` frames; negative numbers move back. Resolves and rejects like `Player.setFrame`. */
  step(count = 1): Promise<number | null> {
    return this.player?.step(count) ?? Promise.resolve(null);
  }

  /** Seek to the newest frame of a live stream. Resolves and rejects like `Player.setFrame`. */
  seekToLiveEdge(): Promise<number | null> {
    return this.player?.seekToLiveEdge() ?? Promise.resolve(null);
  }

  /** Select a camera of the stream by name; an unknown name changes nothing. */
  lookThrough(name: string): void {
    if (this.player !== null) this.player.camera = name;
  }

  /** Turn the scene upside down. */
  flip(): void {
    this.player?.flip();
  }

  /** Ordinal of the frame that is shown; null before the first frame is shown. */
  get frame(): number | null {
    return this.player?.frame ?? null;
  }

  /** Set the attribute `frame`; React and Vue set a property instead of an attribute if an element has one of that name. */
  set frame(frame: number | string | null | undefined) {
    if (frame === null || frame === undefined) this.removeAttribute("frame");
    else this.setAttribute("frame", String(frame));
  }

  /** The description of the stream; null before its first frame. */
  get info(): StreamInfo | null {
    return this.player?.info ?? null;
  }

  get isPlaying(): boolean {
    return this.player?.isPlaying ?? false;
  }

  /** Statistics of the current frame and of playback; null before the first frame. */
  get statistics(): Statistics | null {
    return this.player?.statistics ?? null;
  }

  /** Draw the current frame from a camera, given by its index. Resolves and rejects like `Player.takePicture`. */
  async takePicture(cameraIndex: number, format: PixelFormat = "bytes"): Promise<Float32Array> {
    const camera = this.player?.cameras[cameraIndex];
    if (this.player === null || camera === undefined) {
      throw new RangeError(`the stream has no camera with index ${cameraIndex}`);
    }
    return this.player.takePicture(camera, format);
  }

  #open(): void {
    const session = this.#session;
    const url = this.getAttribute("src") || null; // pages without a stream yet may set ""
    const isLive = this.hasAttribute("live");
    const source = this.#source ?? (url === null ? null : { url, isLive });
    if (session === null || source === null) return;
    if ("bytes" in source) this.#source = null; // the worker receives the bytes, so they cannot be opened again
    const frame = Number.parseInt(this.getAttribute("frame") ?? "", 10);
    session.open(source, this.getAttribute("poster"), Number.isFinite(frame) ? frame : null);
    session.player.camera = this.getAttribute("camera");
    if (this.hasAttribute("autoplay")) session.player.play();
  }

  #showFault(message: string): void {
    const fault = makeFault("limit", message);
    for (const element of this.#root.querySelectorAll("canvas, .bar")) element.remove(); // they need a player
    const panel = this.#root.querySelector<HTMLElement>(".fault");
    panel?.replaceChildren(describeFault(fault, null));
    panel?.removeAttribute("hidden");
    this.dispatchEvent(new CustomEvent("error", { detail: fault }));
  }
}

export interface QuarcPlayer {
  addEventListener<K extends keyof PlayerEvents>(
    type: K,
    listener: (event: CustomEvent<PlayerEvents[K]>) => void,
    options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener<K extends keyof HTMLElementEventMap>(
    type: K,
    listener: (this: HTMLElement, event: HTMLElementEventMap[K]) => unknown,
    options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(
    type: string,
    listener: EventListenerOrEventListenerObject,
    options?: boolean | AddEventListenerOptions,
  ): void;
  removeEventListener<K extends keyof PlayerEvents>(
    type: K,
    listener: (event: CustomEvent<PlayerEvents[K]>) => void,
    options?: boolean | EventListenerOptions,
  ): void;
  removeEventListener<K extends keyof HTMLElementEventMap>(
    type: K,
    listener: (this: HTMLElement, event: HTMLElementEventMap[K]) => unknown,
    options?: boolean | EventListenerOptions,
  ): void;
  removeEventListener(
    type: string,
    listener: EventListenerOrEventListenerObject,
    options?: boolean | EventListenerOptions,
  ): void;
}

declare global {
  interface HTMLElementTagNameMap {
    "quarc-player": QuarcPlayer;
  }
}

/** Parse the speed in an attribute; return 1 if the text is not a positive number. */
function parseSpeed(text: string | null): number {
  const speed = Number(text);
  return text !== null && Number.isFinite(speed) && speed > 0 ? speed : 1;
}
