/**
 * Frames on a stage at their times: decoded ahead in a worker, shown when they are due.
 *
 * Where a frame is late the one before stays, and time waits for it: no frame is left out.
 */

import type {
  DecodeReply,
  DecodeRequest,
  FramePacket,
  PartialScene,
  PlayerFault,
  StreamInfo,
  StreamSource,
} from "./protocol.js";

const RING = 12; // frames decoded ahead

/** What is shown on. */
export interface Screen {
  readonly isBusy: boolean;
  begin(info: StreamInfo): void;
  show(packet: FramePacket): void;
  showPartial(scene: PartialScene): void;
}

/** What is told of playing. */
export interface PlayingEvents {
  onInfo(info: StreamInfo): void;
  /** Playing began or ended, or waits for frames, or does not any longer. */
  onState(): void;
  onProgress(bytes: number, byteLength: number | null): void;
  /** A frame has been decoded; it is shown later, unless a seek comes first. */
  onDecoded(packet: FramePacket): void;
  onError(fault: PlayerFault): void;
}

export class Playing {
  readonly #decoder: Worker;
  readonly #screen: Screen;
  readonly #events: PlayingEvents;
  #ring: FramePacket[] = [];
  #info: StreamInfo | null = null;
  #run = 0;
  #end: number | null = null;
  #shown: number | null = null;
  #dueAt = 0;
  #isFirst = true;
  #timer = 0;

  isPlaying = false;
  isLooping = false;
  speed = 1;

  constructor(decoder: Worker, screen: Screen, events: PlayingEvents) {
    this.#decoder = decoder;
    this.#screen = screen;
    this.#events = events;
    decoder.onmessage = ({ data }) => this.#take(data as DecodeReply);
    decoder.onerror = (event) => {
      const message = event.message || "the decoder could not be started";
      events.onError({ kind: "player", message, rejectId: null, frame: null });
    };
  }

  get info(): StreamInfo | null {
    return this.#info;
  }

  /** Ordinal of the frame that is shown; null before the first. */
  get frame(): number | null {
    return this.#shown;
  }

  /** Ordinal after the last frame, where it is known. */
  get end(): number | null {
    const { firstFrame = 0, frameCount = null } = this.#info ?? {};
    return this.#end ?? (frameCount === null ? null : firstFrame + frameCount);
  }

  /** Ordinal after the last frame that has been decoded. */
  get bufferedTo(): number {
    return (this.#ring.at(-1)?.frame ?? this.#shown ?? -1) + 1;
  }

  /** Whether it plays, but has no frame to show. */
  get isWaiting(): boolean {
    return this.isPlaying && this.#ring.length === 0 && !this.#isAtEnd;
  }

  open(source: StreamSource): void {
    this.#restart();
    this.#info = this.#end = this.#shown = null;
    const transferred = "bytes" in source ? [source.bytes] : [];
    this.#decoder.postMessage({ kind: "open", source, run: this.#run }, transferred);
    this.#grant(RING);
  }

  play(): void {
    if (this.isPlaying) return;
    this.isPlaying = true;
    this.#dueAt = performance.now();
    if (this.#isAtEnd && this.#info !== null) this.seek(this.#info.firstFrame);
    this.#events.onState();
    this.#wait();
  }

  pause(): void {
    this.isPlaying = false;
    this.#events.onState();
  }

  /** Show a frame as soon as it is decoded. */
  seek(frame: number): void {
    if (this.#info === null) return;
    const first = this.#info.firstFrame;
    const last = this.end === null ? frame : this.end - 1;
    this.#restart();
    this.#request({ kind: "seek", frame: Math.max(first, Math.min(last, frame)), run: this.#run });
    this.#grant(RING);
    this.#events.onState();
  }

  /** Show the next frame, or the one before. */
  step(by: 1 | -1): void {
    this.pause();
    if (this.#shown === null) return;
    if (by === 1 && this.#ring.length > 0 && !this.#screen.isBusy) this.#showNext();
    else this.seek(this.#shown + by);
  }

  /** Tell that a frame is on the screen. */
  shown(packet: FramePacket): void {
    this.#shown = packet.frame;
    this.#wait();
  }

  close(): void {
    clearTimeout(this.#timer);
    this.#decoder.onmessage = this.#decoder.onerror = null;
    this.#decoder.terminate();
  }

  get #isAtEnd(): boolean {
    return this.#shown !== null && this.#shown + 1 === this.end && this.#ring.length === 0;
  }

  #take(reply: DecodeReply): void {
    if (runOf(reply) !== this.#run) return;
    if (reply.kind === "frame") this.#receive(reply.packet);
    else if (reply.kind === "info") this.#begin(reply.info);
    else if (reply.kind === "partial") this.#showPartial(reply.scene);
    else if (reply.kind === "progress") this.#events.onProgress(reply.bytes, reply.byteLength);
    else if (reply.kind === "error") this.#events.onError(reply.error);
    else this.#finish(reply.frameCount);
  }

  #begin(info: StreamInfo): void {
    if (this.#info === null) this.#screen.begin(info);
    this.#info = info;
    this.#events.onInfo(info);
  }

  #showPartial(scene: PartialScene): void {
    if (this.#shown === null && !this.#screen.isBusy) this.#screen.showPartial(scene);
  }

  #receive(packet: FramePacket): void {
    this.#ring.push(packet);
    this.#events.onDecoded(packet);
    this.#wait();
  }

  #finish(frameCount: number): void {
    this.#end = (this.#info?.firstFrame ?? 0) + frameCount;
    this.#events.onState();
    this.#wait();
  }

  /** Wait until the next frame is due; a first one is due at once. */
  #wait(): void {
    clearTimeout(this.#timer);
    if (this.#isFirst) {
      this.#goOn();
    } else if (this.isPlaying) {
      this.#timer = window.setTimeout(() => this.#goOn(), this.#dueAt - performance.now());
    }
  }

  #goOn(): void {
    if (this.#screen.isBusy) return; // `shown` is going to tell
    if (this.#ring.length > 0) this.#showNext();
    else if (this.#isAtEnd) this.#turnBack();
  }

  #showNext(): void {
    const packet = this.#ring.shift();
    if (packet === undefined) return;
    const { timescale = 30, frameTicks = 1 } = this.#info ?? {};
    const lasts = (1000 * frameTicks) / timescale / this.speed;
    const now = performance.now();
    this.#dueAt = now - this.#dueAt > lasts ? now + lasts : this.#dueAt + lasts;
    this.#isFirst = false;
    this.#screen.show(packet);
    this.#grant(1);
  }

  #turnBack(): void {
    if (!this.isPlaying || this.#info === null) return;
    if (this.isLooping) this.seek(this.#info.firstFrame);
    else this.pause();
  }

  /** What was asked for before does not matter any longer. */
  #restart(): void {
    clearTimeout(this.#timer);
    this.#run += 1;
    this.#ring = [];
    this.#isFirst = true;
  }

  #grant(frames: number): void {
    this.#request({ kind: "more", frames, run: this.#run });
  }

  #request(request: DecodeRequest): void {
    this.#decoder.postMessage(request);
  }
}

function runOf(reply: DecodeReply): number {
  if (reply.kind === "frame") return reply.packet.run;
  return reply.kind === "partial" ? reply.scene.run : reply.run;
}
