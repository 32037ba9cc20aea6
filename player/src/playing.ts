/**
 * Playback: a worker decodes frames ahead, and they are shown when they are due.
 *
 * If a frame is late, the previous one stays on the screen and playback pauses: no frame is skipped. In a loop, the
 * first frames are decoded while the last ones are shown, so that there is no gap.
 */

import { DecodeLink } from "./decode-link.js";
import { Extent } from "./extent.js";
import type { PlayingEvents, Screen } from "./playing-events.js";
import type { DecodeReply, FramePacket, StreamInfo, StreamSource } from "./protocol.js";

const RING = 12; // frames decoded ahead
const SEEK_PATIENCE_MS = 150; // until a seek that has shown nothing is replaced by the next one

export class Playing {
  readonly #link: DecodeLink;
  readonly #screen: Screen;
  readonly #events: PlayingEvents;
  #ring: FramePacket[] = [];
  #extent = new Extent();
  #runShown = 0;
  #start: number | null = null; // the frame to show first
  #shown: number | null = null;
  #dueAt = 0;
  #isFirst = true; // no frame has been shown since the last opening or seek
  #timer = 0;
  #sought: number | null = null; // target of the current seek
  #wanted: number | null = null; // target of the next seek
  #soughtAt = 0;
  #steps = 0; // number of following frames still to be shown
  #isPlaying = false;
  #isLooping = false;

  /** Number of frames that were not decoded when they were due. */
  lateFrames = 0;
  speed = 1;

  constructor(decoder: Worker, screen: Screen, events: PlayingEvents) {
    this.#screen = screen;
    this.#events = events;
    this.#link = new DecodeLink(decoder, (reply) => this.#take(reply), (fault) => events.onError(fault));
  }

  /** The extent of the stream, as far as known. */
  get extent(): Extent {
    return this.#extent;
  }

  get isPlaying(): boolean {
    return this.#isPlaying;
  }

  get isLooping(): boolean {
    return this.#isLooping;
  }

  set isLooping(isLooping: boolean) {
    this.#isLooping = isLooping;
    this.#events.onState();
    if (isLooping) this.#decodeAgain();
  }

  /** Ordinal of the frame that is shown; null before the first. */
  get frame(): number | null {
    return this.#shown;
  }

  /** Ordinal of the frame that is shown or, during a seek, of its target. */
  get target(): number | null {
    const target = this.#wanted ?? this.#sought ?? this.#shown;
    return target === Infinity ? (this.#extent.liveEdge ?? this.#shown) : target; // the last frame, whose ordinal is not known yet
  }

  /** Frames from the current one to the newest of a live stream; null if there is none. */
  get framesBehind(): number | null {
    const { liveEdge } = this.#extent;
    return this.#shown === null || liveEdge === null ? null : Math.max(0, liveEdge - this.#shown);
  }

  /** Whether a seek or step is in progress: its frame is not shown yet. */
  get isSeeking(): boolean {
    const isUnderWay = this.#isFirst || this.#sought !== null || this.#wanted !== null || this.#steps > 0;
    return isUnderWay || this.#screen.isBusy;
  }

  /** Number of decoded frames that are not shown yet. */
  get bufferedFrames(): number {
    return this.#ring.length;
  }

  /** Ordinal after the last decoded frame of the range that contains the current one. */
  get bufferedTo(): number {
    const last = this.#ring.filter(({ run }) => run === this.#runShown).at(-1);
    return (last?.frame ?? this.#shown ?? -1) + 1;
  }

  /** Whether playback waits for frames, or a seek or opening is in progress. */
  get isWaiting(): boolean {
    const wants = this.#isPlaying || this.#isFirst;
    return this.#link.run > 0 && wants && this.#ring.length === 0 && !this.#screen.isBusy && !this.#isAtEnd;
  }

  /** Open a stream at a frame; null for its first. */
  open(source: StreamSource, start: number | null = null): void {
    this.#restart();
    this.#start = start;
    this.#extent = new Extent();
    this.#shown = this.#sought = null;
    this.lateFrames = 0;
    this.#link.open(source, RING);
  }

  play(): void {
    if (this.#isPlaying) return;
    this.#isPlaying = true;
    this.#steps = 0;
    this.#dueAt = performance.now();
    if (this.#isAtEnd) this.setFrame(this.#extent.firstFrame);
    this.#events.onState();
    this.#wait();
  }

  pause(): void {
    if (!this.#isPlaying) return;
    this.#isPlaying = false;
    this.#events.onState();
  }

  /**
   * Show a frame as soon as it is decoded; Infinity, or any frame after the end, means the last one. If seeks follow
   * each other quickly, some are skipped.
   */
  setFrame(frame: number): void {
    if (this.#extent.info === null) return;
    const target = this.#extent.clamp(frame);
    if (!this.#isFirst || performance.now() > this.#soughtAt + SEEK_PATIENCE_MS) this.#seek(target);
    else {
      this.#wanted = target;
      clearTimeout(this.#timer);
      this.#timer = window.setTimeout(() => this.#seekWanted(), SEEK_PATIENCE_MS);
    }
    this.#events.onState();
  }

  /** Pause, and show the frame `count` frames later. */
  step(by: number): void {
    this.pause();
    const { target } = this;
    if (target === null) return;
    const isNext = by === 1 && this.#wanted === null && !this.#isFirst && !this.#isAtEnd;
    if (!isNext) this.setFrame(target + this.#steps + by);
    else {
      this.#steps += 1; // it may have to be decoded first
      this.#wait();
    }
  }

  /** Note that a frame is on the screen. */
  shown(packet: FramePacket): void {
    const isOld = packet.run < this.#link.run && this.#isFirst; // a seek has started since
    if (!isOld && !packet.isPreview) {
      this.#shown = packet.frame;
      this.#runShown = packet.run;
      this.#sought = null;
      this.#seekWanted();
    }
    this.#wait();
  }

  close(): void {
    clearTimeout(this.#timer);
    this.#link.close();
  }

  get #isAtEnd(): boolean {
    const isLast = this.#shown !== null && this.#shown + 1 === this.#extent.end;
    return isLast && this.#ring.length === 0 && this.#runShown === this.#link.run;
  }

  #take(reply: DecodeReply): void {
    if (reply.kind === "frame") this.#receive(reply.packet);
    else if (reply.kind === "info") this.#begin(reply.info);
    else if (reply.kind === "progress") this.#events.onProgress(reply.bytes, reply.byteLength);
    else if (reply.kind === "error") this.#events.onError(reply.error);
    else if (reply.kind === "edge") this.#grow(reply.frame);
    else this.#finish(reply.frameCount);
  }

  #begin(info: StreamInfo): void {
    const isNew = this.#extent.info === null;
    if (isNew) this.#screen.begin(info);
    this.#extent.info = info;
    // The frame being decoded, or a part of it, must not be shown.
    if (isNew && this.#start !== null && this.#start > info.firstFrame) this.#seek(this.#start);
    this.#events.onInfo(info);
  }

  #receive(packet: FramePacket): void {
    this.#events.onDecoded(packet);
    if (packet.isPreview) {
      if (this.#shown === null && !this.#screen.isBusy) this.#screen.show(packet);
      return;
    }
    this.#ring.push(packet);
    this.#wait();
  }

  #grow(frame: number): void {
    this.#extent.grow(frame);
    this.#events.onLiveEdge(frame);
  }

  #finish(frameCount: number): void {
    this.#extent.finish(frameCount);
    this.#events.onState();
    this.#decodeAgain();
    this.#wait();
  }

  /** In a loop, continue decoding at the first frame. */
  #decodeAgain(): void {
    const { firstFrame, counted } = this.#extent;
    const isLong = counted !== null && counted > firstFrame + 1;
    const last = this.#ring.at(-1);
    const isDecoded = last === undefined ? this.#isAtEnd : last.run === this.#link.run && last.frame + 1 === counted;
    if (!this.#isLooping || !isLong || !isDecoded || this.#isFirst) return;
    this.#link.seek(firstFrame, RING - this.#ring.length);
  }

  /** Wait until the next frame is due; the first one is due at once. */
  #wait(): void {
    if (this.#wanted !== null && this.#isFirst && this.#ring.length === 0) return; // its timer runs
    clearTimeout(this.#timer);
    if (this.#isFirst || this.#steps > 0) this.#goOn();
    else if (this.#isPlaying) {
      this.#timer = window.setTimeout(() => this.#goOn(), this.#dueAt - performance.now());
    }
  }

  #goOn(): void {
    if (this.#screen.isBusy) return; // `shown` comes back here
    const [next] = this.#ring;
    const isSeam = next !== undefined && !this.#isFirst && next.run !== this.#runShown;
    if (this.#isAtEnd || (isSeam && !this.#isLooping)) this.#stopAtEnd();
    else if (next !== undefined) this.#showNext();
    else this.#events.onState(); // playback may have to wait from now on
  }

  #showNext(): void {
    const packet = this.#ring.shift();
    if (packet === undefined) return;
    const lasts = this.#extent.frameMs / this.speed;
    const now = performance.now();
    const isLate = now - this.#dueAt > lasts;
    if (isLate && this.#isPlaying && !this.#isFirst) this.lateFrames += 1;
    this.#dueAt = isLate || this.#isFirst ? now + lasts : this.#dueAt + lasts;
    this.#isFirst = false;
    this.#steps = Math.max(0, this.#steps - 1);
    this.#screen.show(packet);
    this.#link.allow(1);
  }

  #stopAtEnd(): void {
    this.#steps = 0;
    if (!this.#isPlaying) return;
    if (this.#isLooping) {
      this.#decodeAgain();
      if (this.#link.run !== this.#runShown) return;
    }
    this.#ring = []; // of a loop that has been disabled
    if (this.#link.run !== this.#runShown) this.#runShown = this.#link.abandon();
    this.pause();
    this.#events.onEnded();
  }

  #seekWanted(): void {
    const wanted = this.#wanted;
    if (wanted !== null) this.#seek(wanted);
  }

  #seek(frame: number): void {
    this.#restart();
    this.#soughtAt = performance.now();
    this.#sought = frame;
    this.#link.seek(frame, RING);
  }

  /** Cancel all previous requests. */
  #restart(): void {
    clearTimeout(this.#timer);
    this.#ring = [];
    this.#isFirst = true;
    this.#steps = 0;
    this.#wanted = null;
  }
}
