/**
 * Playback: frames are decoded ahead in a worker and shown when they are due.
 *
 * If a frame is late, the one before stays on the screen and time waits for it: no frame is left
 * out. In a loop the first frames are decoded while the last ones are shown, so it has no seam.
 */

import type {
  DecodeReply,
  DecodeRequest,
  FramePacket,
  PlayerFault,
  StreamInfo,
  StreamSource,
} from "./protocol.js";

const RING = 12; // frames decoded ahead
const SEEK_PATIENCE_MS = 150; // before a seek that has shown nothing gives way to the next one

/** What frames are shown on. */
export interface Screen {
  readonly isBusy: boolean;
  begin(info: StreamInfo): void;
  show(packet: FramePacket): void;
}

export interface PlayingEvents {
  onInfo(info: StreamInfo): void;
  /** Playing, waiting or the end of the stream has changed. */
  onState(): void;
  onEnded(): void;
  onProgress(bytes: number, byteLength: number | null): void;
  /** A live stream has grown, or it is known now how far it goes. */
  onLiveEdge(frame: number): void;
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
  #run = 0; // counts openings, seeks and laps of a loop
  #runOpened = 0;
  #runShown = 0;
  #start: number | null = null; // the frame to show first
  #end: number | null = null;
  #liveEdge: number | null = null;
  #shown: number | null = null;
  #dueAt = 0;
  #isFirst = true; // no frame of the last opening or seek has been shown
  #timer = 0;
  #sought: number | null = null; // by the present seek
  #wanted: number | null = null; // where to seek when that is done
  #soughtAt = 0;
  #steps = 0; // to frames that follow, which are still to be shown
  #isPlaying = false;
  #isLooping = false;

  /** Frames that were not there when they were due. */
  lateFrames = 0;
  speed = 1;

  constructor(decoder: Worker, screen: Screen, events: PlayingEvents) {
    this.#decoder = decoder;
    this.#screen = screen;
    this.#events = events;
    decoder.onmessage = ({ data }) => this.#take(data as DecodeReply);
    decoder.onerror = (event) => {
      const message = event.message || "the decode worker could not be started";
      events.onError({ kind: "player", message, rejectId: null, frame: null });
    };
  }

  get info(): StreamInfo | null {
    return this.#info;
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
    if (isLooping && this.#end !== null) this.#decodeAgain();
  }

  /** Ordinal of the frame that is shown; null before the first. */
  get frame(): number | null {
    return this.#shown;
  }

  /** Ordinal of the frame that is shown or, while a seek is under way, of that one. */
  get target(): number | null {
    const target = this.#wanted ?? this.#sought ?? this.#shown;
    return target === Infinity ? (this.#liveEdge ?? this.#shown) : target; // the last frame, whichever that is
  }

  /** Ordinal of the newest frame of a live stream; null if it is not live, or while that is not known. */
  get liveEdge(): number | null {
    return this.#end === null ? this.#liveEdge : null;
  }

  /** Whether a seek or a step is under way: its frame is not shown yet. */
  get isSeeking(): boolean {
    const isUnderWay = this.#isFirst || this.#sought !== null || this.#wanted !== null || this.#steps > 0;
    return isUnderWay || this.#screen.isBusy;
  }

  /** Ordinal after the last frame, where it is known. */
  get end(): number | null {
    const { firstFrame = 0, frameCount = null } = this.#info ?? {};
    return this.#end ?? (frameCount === null ? null : firstFrame + frameCount);
  }

  /** Frames that are decoded and not shown yet. */
  get bufferedFrames(): number {
    return this.#ring.length;
  }

  /** Ordinal after the last frame that is decoded, in one piece with the one that is shown. */
  get bufferedTo(): number {
    const last = this.#ring.filter(({ run }) => run === this.#runShown).at(-1);
    return (last?.frame ?? this.#shown ?? -1) + 1;
  }

  /** Whether there is nothing to show: while playing, or until a seek or an opening is done. */
  get isWaiting(): boolean {
    const wants = this.#isPlaying || this.#isFirst;
    return this.#run > 0 && wants && this.#ring.length === 0 && !this.#screen.isBusy && !this.#isAtEnd;
  }

  /** Open a stream at a frame; null for its first one. */
  open(source: StreamSource, start: number | null = null): void {
    this.#restart();
    this.#runOpened = this.#run;
    this.#start = start;
    this.#info = this.#end = this.#liveEdge = this.#shown = this.#sought = null;
    this.lateFrames = 0;
    const transferred = "bytes" in source ? [source.bytes] : [];
    this.#decoder.postMessage({ kind: "open", source, run: this.#run }, transferred);
    this.#grant(RING);
  }

  play(): void {
    if (this.#isPlaying) return;
    this.#isPlaying = true;
    this.#steps = 0;
    this.#dueAt = performance.now();
    if (this.#isAtEnd && this.#info !== null) this.setFrame(this.#info.firstFrame);
    this.#events.onState();
    this.#wait();
  }

  pause(): void {
    if (!this.#isPlaying) return;
    this.#isPlaying = false;
    this.#events.onState();
  }

  /**
   * Show a frame as soon as it is decoded; Infinity is the last one, and so is a frame behind it.
   * Of seeks in quick succession some are left out.
   */
  setFrame(frame: number): void {
    if (this.#info === null) return;
    const first = this.#info.firstFrame;
    const last = this.end === null ? Infinity : this.end - 1; // else the decoder finds it
    const target = Math.max(first, Math.min(last, Math.round(frame)));
    if (!this.#isFirst || performance.now() > this.#soughtAt + SEEK_PATIENCE_MS) this.#seek(target);
    else {
      this.#wanted = target;
      clearTimeout(this.#timer);
      this.#timer = window.setTimeout(() => this.#seekWanted(), SEEK_PATIENCE_MS);
    }
    this.#events.onState();
  }

  /** Pause, and show the frame so many frames on. */
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

  /** Take note that a frame is on the screen. */
  shown(packet: FramePacket): void {
    const isOld = packet.run < this.#run && this.#isFirst; // a seek has begun since
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
    this.#decoder.onmessage = this.#decoder.onerror = null;
    this.#decoder.terminate();
  }

  get #isAtEnd(): boolean {
    const isLast = this.#shown !== null && this.#shown + 1 === this.end;
    return isLast && this.#ring.length === 0 && this.#runShown === this.#run;
  }

  #take(reply: DecodeReply): void {
    const run = runOf(reply);
    const isOfStream = reply.kind === "info" || reply.kind === "edge";
    if (run !== this.#run && !(isOfStream && run >= this.#runOpened)) return;
    if (reply.kind === "frame") this.#receive(reply.packet);
    else if (reply.kind === "info") this.#begin(reply.info);
    else if (reply.kind === "progress") this.#events.onProgress(reply.bytes, reply.byteLength);
    else if (reply.kind === "error") this.#events.onError(reply.error);
    else if (reply.kind === "edge") this.#events.onLiveEdge((this.#liveEdge = reply.frame));
    else this.#finish(reply.frameCount);
  }

  #begin(info: StreamInfo): void {
    const isNew = this.#info === null;
    if (isNew) this.#screen.begin(info);
    this.#info = info;
    // What is being decoded now, the first frame or a part of it, is not to be shown.
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

  #finish(frameCount: number): void {
    this.#end = (this.#info?.firstFrame ?? 0) + frameCount;
    this.#events.onState();
    this.#decodeAgain();
    this.#wait();
  }

  /** In a loop, go on decoding at the first frame. */
  #decodeAgain(): void {
    const { firstFrame = 0 } = this.#info ?? {};
    const isLong = this.#end !== null && this.#end > firstFrame + 1;
    const last = this.#ring.at(-1);
    const isDecoded = last === undefined ? this.#isAtEnd : last.run === this.#run && last.frame + 1 === this.#end;
    if (!this.#isLooping || !isLong || !isDecoded || this.#isFirst) return;
    this.#run += 1;
    this.#request({ kind: "seek", frame: firstFrame, run: this.#run });
    this.#grant(RING - this.#ring.length);
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
    else this.#events.onState(); // it may be waiting
  }

  #showNext(): void {
    const packet = this.#ring.shift();
    if (packet === undefined) return;
    const { timescale = 30, frameTicks = 1 } = this.#info ?? {};
    const lasts = (1000 * frameTicks) / timescale / this.speed;
    const now = performance.now();
    const isLate = now - this.#dueAt > lasts;
    if (isLate && this.#isPlaying && !this.#isFirst) this.lateFrames += 1;
    this.#dueAt = isLate || this.#isFirst ? now + lasts : this.#dueAt + lasts;
    this.#isFirst = false;
    this.#steps = Math.max(0, this.#steps - 1);
    this.#screen.show(packet);
    this.#grant(1);
  }

  #stopAtEnd(): void {
    this.#steps = 0;
    if (!this.#isPlaying) return;
    if (this.#isLooping) {
      this.#decodeAgain();
      if (this.#run !== this.#runShown) return;
    }
    this.#ring = []; // of a loop that has been switched off
    if (this.#run !== this.#runShown) this.#runShown = ++this.#run;
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
    this.#request({ kind: "seek", frame, run: this.#run, orLast: true });
    this.#grant(RING);
  }

  /** Nothing that was asked for before is wanted any longer. */
  #restart(): void {
    clearTimeout(this.#timer);
    this.#run += 1;
    this.#ring = [];
    this.#isFirst = true;
    this.#steps = 0;
    this.#wanted = null;
  }

  #grant(frames: number): void {
    this.#request({ kind: "more", frames, run: this.#run });
  }

  #request(request: DecodeRequest): void {
    this.#decoder.postMessage(request);
  }
}

function runOf(reply: DecodeReply): number {
  return reply.kind === "frame" ? reply.packet.run : reply.run;
}
