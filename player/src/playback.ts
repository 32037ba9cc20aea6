/**
 * Playback: a worker decodes frames ahead of time, and each frame is shown when it is due.
 *
 * If a frame is late, the previous frame stays on the screen until the late frame is decoded; no frame is skipped. In a
 * loop, the first frames are decoded while the last frames are shown, so that there is no gap.
 */

import { DecodeLink } from "./decode-link.js";
import { Extent } from "./extent.js";
import type { PlaybackEvents, Screen } from "./playback-events.js";
import type { DecodeReply, FramePacket, PlayerFault, StreamInfo, StreamSource } from "./protocol.js";
import { makeFault } from "./stream-error.js";

const BUFFER_FRAMES = 12; // frames decoded ahead
const SEEK_TIMEOUT_MS = 150; // after which a new seek replaces a seek that has not shown its frame

export class Playback {
  readonly #link: DecodeLink;
  readonly #screen: Screen;
  readonly #events: PlaybackEvents;
  #buffer: FramePacket[] = [];
  #fault: PlayerFault | null = null; // the error after the frames in the buffer; reported when the next frame is due
  #extent = new Extent();
  #shownRun = 0;
  #startFrame: number | null = null; // the frame to show first
  #shownFrame: number | null = null;
  #dueTime = 0;
  #isBeforeFirstFrame = true; // no frame has been shown since the stream was opened or the last seek began
  #timer = 0;
  #seekTarget: number | null = null; // target of the current seek
  #nextSeekTarget: number | null = null; // target of the next seek
  #seekTime = 0;
  #pendingSteps = 0; // number of single-frame steps whose frames are not shown yet
  #isPlaying = false;
  #isLooping = false;
  #speed = 1;

  /** Number of frames of this stream that were not decoded when they were due. */
  lateFrames = 0;

  constructor(screen: Screen, events: PlaybackEvents) {
    this.#screen = screen;
    this.#events = events;
    this.#link = new DecodeLink((reply) => this.#handleReply(reply), (fault) => this.#handleFault(fault));
  }

  /** The range of frames of the stream, as far as it is known. */
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
    if (isLooping) this.#decodeNextLap();
    else if (this.#isLastShown && !this.isSeeking) this.#dropNextLap();
    this.#events.onState();
  }

  get speed(): number {
    return this.#speed;
  }

  /** Set the speed; the time until the next frame changes with it. */
  set speed(speed: number) {
    const now = performance.now();
    this.#dueTime = now + ((this.#dueTime - now) * this.#speed) / speed;
    this.#speed = speed;
    if (this.#isPlaying) this.#scheduleNext();
  }

  /** Ordinal of the frame that is shown; null before the first frame is shown. */
  get frame(): number | null {
    return this.#shownFrame;
  }

  /** Ordinal of the frame that is shown or, during a seek, of the seek's target. */
  get target(): number | null {
    const target = this.#nextSeekTarget ?? this.#seekTarget ?? this.#shownFrame;
    // The target is Infinity while the ordinal of the last frame is unknown.
    return target === Infinity ? (this.#extent.liveEdge ?? this.#shownFrame) : target;
  }

  /** Number of frames from the current frame to the newest frame of a live stream; null if that is unknown. */
  get framesBehind(): number | null {
    const { liveEdge } = this.#extent;
    return this.#shownFrame === null || liveEdge === null ? null : Math.max(0, liveEdge - this.#shownFrame);
  }

  /** Whether the frame of a seek or step is not shown yet. */
  get isSeeking(): boolean {
    const hasTarget = this.#seekTarget !== null || this.#nextSeekTarget !== null;
    return this.#isBeforeFirstFrame || hasTarget || this.#pendingSteps > 0 || this.#screen.isBusy;
  }

  /** Number of decoded frames that are not shown yet. */
  get bufferedFrames(): number {
    return this.#buffer.length;
  }

  /** Ordinal after the last frame that is decoded without a gap after the current frame. */
  get bufferedTo(): number {
    const lastPacket = this.#buffer.filter(({ run }) => run === this.#shownRun).at(-1);
    return (lastPacket?.frame ?? this.#shownFrame ?? -1) + 1;
  }

  /** Whether playback, a seek, a step or the opening of a stream waits for frames. */
  get isWaiting(): boolean {
    const needsFrames = this.#isPlaying || this.#isBeforeFirstFrame || this.#pendingSteps > 0;
    const hasFrames = this.#buffer.length > 0 || this.#screen.isBusy || this.#isAtEnd || this.#fault !== null;
    return this.#link.run > 0 && needsFrames && !hasFrames;
  }

  /** Open a stream at a frame; null means its first frame. */
  open(source: StreamSource, startFrame: number | null = null): void {
    this.#link.open(source, BUFFER_FRAMES);
    this.#reset();
    this.#startFrame = startFrame;
    this.#extent = new Extent();
    this.#shownFrame = this.#seekTarget = null;
    this.lateFrames = 0;
  }

  play(): void {
    if (this.#isPlaying) return;
    this.#isPlaying = true;
    this.#pendingSteps = 0;
    this.#dueTime = performance.now();
    if (this.#isAtEnd) this.setFrame(this.#extent.firstFrame);
    this.#events.onState();
    this.#scheduleNext();
  }

  pause(): void {
    if (!this.#isPlaying) return;
    this.#isPlaying = false;
    this.#screen.finishMotion();
    this.#events.onState();
  }

  /**
   * Show a frame as soon as it is decoded; Infinity, or any frame after the end, means the last frame. If seeks follow
   * each other quickly, some of them are skipped.
   */
  setFrame(frame: number): void {
    if (this.#extent.info === null) return;
    const target = this.#extent.clamp(frame);
    if (!this.#isBeforeFirstFrame || performance.now() > this.#seekTime + SEEK_TIMEOUT_MS) this.#seek(target);
    else {
      this.#nextSeekTarget = target;
      clearTimeout(this.#timer);
      this.#timer = window.setTimeout(() => this.#seekToNextTarget(), SEEK_TIMEOUT_MS);
    }
    this.#events.onState();
  }

  /** Pause, and move by `count` frames; negative numbers move back. */
  step(count: number): void {
    this.pause();
    const { target } = this;
    if (target === null) return;
    const isNextFrame = count === 1 && this.#nextSeekTarget === null && !this.#isBeforeFirstFrame && !this.#isAtEnd;
    if (!isNextFrame) this.setFrame(target + this.#pendingSteps + count);
    else {
      this.#pendingSteps += 1; // the next frame may not be decoded yet
      this.#scheduleNext();
    }
  }

  /** Update the state after a packet has appeared on the screen. */
  noteShown(packet: FramePacket): void {
    if (!packet.isPreview && this.#extent.info !== null) { // info is null if the packet belongs to the previous stream
      this.#shownFrame = packet.frame;
      this.#shownRun = packet.run;
      const isOutdated = packet.run < this.#link.run && this.#isBeforeFirstFrame; // a seek has started since then
      if (!isOutdated) {
        this.#seekTarget = null;
        this.#seekToNextTarget();
      }
    }
    this.#scheduleNext();
  }

  close(): void {
    clearTimeout(this.#timer);
    this.#link.close();
  }

  get #isAtEnd(): boolean {
    return this.#isLastShown && this.#buffer.length === 0 && this.#shownRun === this.#link.run;
  }

  get #isLastShown(): boolean {
    return this.#shownFrame !== null && this.#shownFrame + 1 === this.#extent.endFrame;
  }

  #handleReply(reply: DecodeReply): void {
    if (reply.kind === "frame") this.#handlePacket(reply.packet);
    else if (reply.kind === "info") this.#handleInfo(reply.info);
    else if (reply.kind === "progress") this.#events.onProgress(reply.bytes, reply.byteLength);
    else if (reply.kind === "error") this.#handleFault(reply.error);
    else if (reply.kind === "edge") this.#handleLiveEdge(reply.frame);
    else this.#handleEnd(reply.frameCount);
  }

  #handleInfo(info: StreamInfo): void {
    const isFirstInfo = this.#extent.info === null;
    if (isFirstInfo) this.#screen.begin(info);
    this.#extent.info = info;
    // Neither the frame that is being decoded nor a preview of it may be shown.
    if (isFirstInfo && this.#startFrame !== null && this.#startFrame > info.firstFrame) this.#seek(this.#startFrame);
    this.#events.onInfo(info);
  }

  #handlePacket(packet: FramePacket): void {
    this.#events.onDecoded(packet);
    if (packet.isPreview) {
      if (this.#shownFrame === null && !this.#screen.isBusy) this.#screen.show(packet);
      return;
    }
    this.#buffer.push(packet);
    this.#scheduleNext();
  }

  #handleFault(fault: PlayerFault): void {
    this.#fault = fault;
    this.#scheduleNext();
  }

  #handleLiveEdge(frame: number): void {
    this.#extent.grow(frame);
    this.#events.onLiveEdge(frame);
  }

  #handleEnd(frameCount: number): void {
    if (this.#extent.info === null) return this.#handleFault(makeFault("empty", "the stream has no frames"));
    this.#extent.finish(frameCount);
    this.#events.onState();
    this.#decodeNextLap();
    this.#scheduleNext();
  }

  /** In a loop, continue decoding at the first frame after the last frame has been decoded. */
  #decodeNextLap(): void {
    const { firstFrame, decodedEnd } = this.#extent;
    const hasSeveralFrames = decodedEnd !== null && decodedEnd > firstFrame + 1;
    const lastPacket = this.#buffer.at(-1);
    const isLastDecoded = lastPacket?.run === this.#link.run && lastPacket.frame + 1 === decodedEnd;
    const isAllDecoded = lastPacket === undefined ? this.#isAtEnd : isLastDecoded;
    if (!this.#isLooping || !hasSeveralFrames || !isAllDecoded || this.#isBeforeFirstFrame) return;
    this.#link.seek(firstFrame, BUFFER_FRAMES - this.#buffer.length);
  }

  /** Schedule the next frame for the time at which it is due; the first frame is due at once. */
  #scheduleNext(): void {
    const isNextSeekTimed = this.#nextSeekTarget !== null && this.#isBeforeFirstFrame;
    if (isNextSeekTimed && this.#buffer.length === 0) return;
    clearTimeout(this.#timer);
    if (this.#isBeforeFirstFrame || this.#pendingSteps > 0) this.#advance();
    else if (this.#isPlaying) {
      this.#timer = window.setTimeout(() => this.#isPlaying && this.#advance(), this.#dueTime - performance.now());
    }
  }

  #advance(): void {
    if (this.#screen.isBusy) return; // `noteShown` schedules the next frame
    const [nextPacket] = this.#buffer;
    const isNextLap = nextPacket !== undefined && !this.#isBeforeFirstFrame && nextPacket.run !== this.#shownRun;
    if (nextPacket === undefined && this.#fault !== null) {
      this.#pendingSteps = 0;
      this.#events.onError(this.#fault);
    } else if (this.#isAtEnd || (isNextLap && !this.#isLooping)) this.#stopAtEnd();
    else if (nextPacket !== undefined) this.#showNext();
    else this.#events.onState(); // playback now waits for a frame
  }

  #showNext(): void {
    const packet = this.#buffer.shift();
    if (packet === undefined) return;
    const durationMs = this.#extent.frameMs / this.speed;
    const now = performance.now();
    const isLate = now - this.#dueTime > durationMs;
    if (isLate && this.#isPlaying && !this.#isBeforeFirstFrame) this.lateFrames += 1;
    // A headset draws each frame several times, also at normal speed.
    const isSmooth = this.#isPlaying && !this.#isBeforeFirstFrame && (this.speed < 1 || this.#screen.isInHeadset);
    this.#dueTime = isLate || this.#isBeforeFirstFrame ? now + durationMs : this.#dueTime + durationMs;
    this.#isBeforeFirstFrame = false;
    this.#pendingSteps = Math.max(0, this.#pendingSteps - 1);
    this.#screen.show(packet, isSmooth ? durationMs : 0);
    this.#link.allowFrames(1);
  }

  #stopAtEnd(): void {
    this.#pendingSteps = 0;
    if (!this.#isPlaying) return this.#events.onState();
    if (this.#isLooping) {
      this.#decodeNextLap();
      if (this.#link.run !== this.#shownRun) return;
    }
    this.#dropNextLap();
    this.pause();
    this.#events.onEnded();
  }

  /** After the last frame, drop the frames that have been decoded for a loop that has been disabled. */
  #dropNextLap(): void {
    this.#buffer = [];
    if (this.#link.run !== this.#shownRun) this.#shownRun = this.#link.abandon();
  }

  #seekToNextTarget(): void {
    const target = this.#nextSeekTarget;
    if (target !== null) this.#seek(target);
  }

  #seek(frame: number): void {
    this.#reset();
    this.#seekTime = performance.now();
    this.#seekTarget = frame;
    this.#link.seek(frame, BUFFER_FRAMES);
  }

  /** Cancel the timer, seeks, steps and decoded frames. */
  #reset(): void {
    clearTimeout(this.#timer);
    this.#buffer = [];
    this.#fault = null;
    this.#isBeforeFirstFrame = true;
    this.#pendingSteps = 0;
    this.#nextSeekTarget = null;
  }
}
