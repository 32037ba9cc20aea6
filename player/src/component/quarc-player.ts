/**
 * `<quarc-player src="stream.quarc" poster="first.jpg" autoplay loop camera="cam00" speed="1" up="-y">`
 *
 * The events of `Player` are dispatched on the element, too.
 */

import type { Depth } from "../draw/picture.js";
import { DrawingError } from "../draw/programs.js";
import type { Player } from "../player.js";
import type { PlayerEvents } from "../player-events.js";
import type { StreamInfo, StreamSource } from "../protocol.js";
import type { Statistics } from "../statistics.js";
import { AXES } from "../view/scene.js";
import { describeFault } from "./faults.js";
import { Session } from "./session.js";

export class QuarcPlayer extends HTMLElement {
  static readonly observedAttributes = ["src", "loop", "camera", "speed", "up"];

  readonly #root = this.attachShadow({ mode: "open" });
  #session: Session | null = null;
  #source: StreamSource | null = null;

  connectedCallback(): void {
    try {
      this.#session = new Session(this, this.#root);
    } catch (error) {
      if (!(error instanceof DrawingError)) throw error;
      this.#refuse(error.message);
      return;
    }
    for (const name of ["loop", "speed", "up"]) this.attributeChangedCallback(name);
    this.#open();
  }

  disconnectedCallback(): void {
    this.#session?.dispose();
    this.#session = null;
    this.#root.replaceChildren();
  }

  attributeChangedCallback(name: string): void {
    const { player } = this;
    if (player === null) return;
    if (name === "src") {
      this.#source = null;
      this.#open();
    } else if (name === "loop") player.loop = this.hasAttribute("loop");
    else if (name === "speed") player.speed = parseSpeed(this.getAttribute("speed"));
    else if (name === "up") player.up = AXES.find((axis) => axis === this.getAttribute("up")) ?? null;
    else if (name === "camera") player.camera = this.getAttribute("camera");
    this.#session?.refresh();
  }

  /** The player of the element; null while the element is not on a page. */
  get player(): Player | null {
    return this.#session?.player ?? null;
  }

  /** Play a stream in memory, one that needs request headers, or a live one. */
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

  /** Go to a time, seconds from the first frame; as `Player.setFrame`. */
  async seek(seconds: number): Promise<number | null> {
    return (await this.player?.seek(seconds)) ?? null;
  }

  /** Go to a frame, by its ordinal; as `Player.setFrame`. */
  async setFrame(frame: number): Promise<number | null> {
    return (await this.player?.setFrame(frame)) ?? null;
  }

  /** Pause, and move by a number of frames; negative numbers go back. As `Player.setFrame`. */
  async step(by = 1): Promise<number | null> {
    return (await this.player?.step(by)) ?? null;
  }

  /** Go to the newest frame of a live stream; as `Player.seekToLiveEdge`. */
  async seekToLiveEdge(): Promise<number | null> {
    return (await this.player?.seekToLiveEdge()) ?? null;
  }

  /** Look through a camera of the stream; an unknown name changes nothing. */
  lookThrough(name: string): void {
    if (this.player !== null) this.player.camera = name;
  }

  /** Turn the scene upside down. */
  flip(): void {
    this.player?.flip();
  }

  /** Ordinal of the frame that is shown; null before the first. */
  get frame(): number | null {
    return this.player?.frame ?? null;
  }

  /** The description of the stream; null before its first frame. */
  get info(): StreamInfo | null {
    return this.player?.info ?? null;
  }

  get isPlaying(): boolean {
    return this.player?.isPlaying ?? false;
  }

  /** Figures of the frame that is shown; null before the first. */
  get statistics(): Statistics | null {
    return this.player?.statistics ?? null;
  }

  /** As `Player.takePicture`, of the camera with this index. */
  async takePicture(cameraIndex: number, depth: Depth = "bytes"): Promise<Float32Array> {
    const camera = this.player?.cameras[cameraIndex];
    if (this.player === null || camera === undefined) throw new RangeError(`no camera ${cameraIndex}`);
    return this.player.takePicture(camera, depth);
  }

  #open(): void {
    const session = this.#session;
    const url = this.getAttribute("src");
    const isLive = this.hasAttribute("live");
    // The worker cannot resolve relative addresses.
    const addressed = url === null ? null : { url: new URL(url, document.baseURI).href, isLive };
    const source = this.#source ?? addressed;
    if (session === null || source === null) return;
    session.player.camera = this.getAttribute("camera");
    const frame = Number.parseInt(this.getAttribute("frame") ?? "", 10);
    session.open(source, this.getAttribute("poster"), Number.isFinite(frame) ? frame : null);
    if (this.hasAttribute("autoplay")) session.player.play();
  }

  #refuse(message: string): void {
    const fault = { kind: "limit", message, rejectId: null, frame: null } as const;
    this.#root.replaceChildren(describeFault(fault, null));
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
}

/** The speed in an attribute; 1 unless it is a positive number. */
function parseSpeed(text: string | null): number {
  const speed = Number(text);
  return text !== null && Number.isFinite(speed) && speed > 0 ? speed : 1;
}
