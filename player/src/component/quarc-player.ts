/**
 * `<quarc-player src="stream.quarc" autoplay loop camera="cam00" speed="1">`
 *
 * Events: `info` (detail: StreamInfo), `frame` (detail: { frame }), `play`, `pause`, `error`
 * (detail: PlayerFault).
 */

import type { Depth } from "../draw/picture.js";
import { DrawingError } from "../draw/programs.js";
import type { StreamInfo, StreamSource } from "../protocol.js";
import { describeFault } from "./faults.js";
import { Session } from "./session.js";

export class QuarcPlayer extends HTMLElement {
  static readonly observedAttributes = ["src", "loop", "camera", "speed"];

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
    for (const name of ["loop", "speed"]) this.attributeChangedCallback(name);
    this.#open();
  }

  disconnectedCallback(): void {
    this.#session?.dispose();
    this.#session = null;
    this.#root.replaceChildren();
  }

  attributeChangedCallback(name: string): void {
    if (this.#session === null) return;
    const { playing } = this.#session;
    if (name === "src") {
      this.#source = null;
      this.#open();
    } else if (name === "loop") playing.isLooping = this.hasAttribute("loop");
    else if (name === "speed") playing.speed = positive(this.getAttribute("speed")) ?? 1;
    else if (name === "camera") this.lookThrough(this.getAttribute("camera") ?? "");
    this.#session.refresh();
  }

  /** Play a stream that is no file at an address, or is still growing. */
  open(source: StreamSource): void {
    this.#source = source;
    this.#open();
  }

  play(): void {
    this.#session?.playing.play();
  }

  pause(): void {
    this.#session?.playing.pause();
  }

  /** Show a frame, by its ordinal. */
  seek(frame: number): void {
    this.#session?.playing.seek(frame);
  }

  step(by: 1 | -1): void {
    this.#session?.playing.step(by);
  }

  /** Look through a camera of the stream; of one that it does not have, nothing changes. */
  lookThrough(name: string): void {
    const viewer = this.#session?.viewer;
    viewer?.lookThrough(viewer.cameras.findIndex((camera) => camera.name === name));
  }

  /** Ordinal of the frame that is shown; null before the first. */
  get frame(): number | null {
    return this.#session?.playing.frame ?? null;
  }

  get info(): StreamInfo | null {
    return this.#session?.playing.info ?? null;
  }

  get isPlaying(): boolean {
    return this.#session?.playing.isPlaying ?? false;
  }

  /** What a camera sees of the frame that is shown: red, green, blue from 0 to 1, row by row. */
  takePicture(cameraIndex: number, depth: Depth = "bytes"): Float32Array | null {
    return this.#session?.takePicture(cameraIndex, depth) ?? null;
  }

  #open(): void {
    const session = this.#session;
    const url = this.getAttribute("src");
    const isLive = this.hasAttribute("live");
    // The worker knows no page that an address could be relative to.
    const addressed = url === null ? null : { url: new URL(url, document.baseURI).href, isLive };
    const source = this.#source ?? addressed;
    if (session === null || source === null) return;
    session.open(source, this.getAttribute("camera"));
    if (this.hasAttribute("autoplay")) session.playing.play();
  }

  #refuse(message: string): void {
    const fault = { kind: "limit", message, rejectId: null, frame: null } as const;
    this.#root.replaceChildren(...describeFault(fault));
    this.dispatchEvent(new CustomEvent("error", { detail: fault }));
  }
}

function positive(text: string | null): number | null {
  const value = Number(text);
  return text !== null && Number.isFinite(value) && value > 0 ? value : null;
}
