/**
 * The player for programs: draws a stream on a canvas, without any other element.
 *
 *     const player = new Player(document.querySelector("canvas"));
 *     await player.open({ url: "steak.quarc" });
 *     player.play();
 */

import type { Depth } from "./draw/picture.js";
import { Stage, type FrameCost } from "./draw/stage.js";
import { Pending } from "./pending.js";
import { PlayerEventTarget } from "./player-events.js";
import type { OpenOptions, PlayerOptions } from "./player-options.js";
import { Playing } from "./playing.js";
import type { CaptureCamera, FramePacket, PlayerFault, StreamInfo, StreamSource } from "./protocol.js";
import { rateOf, Recorder, type Statistics } from "./statistics.js";
import { Controls } from "./view/controls.js";
import type { Axis } from "./view/scene.js";
import { Viewer } from "./view/viewer.js";
import { makeDecoder, makeSorter } from "./workers.js";

export class Player extends PlayerEventTarget {
  readonly #stage: Stage;
  readonly #playing: Playing;
  readonly #viewer: Viewer;
  readonly #controls: Controls | null;
  readonly #recorder = new Recorder();
  readonly #pending = new Pending();
  #cameraWanted: string | null = null;
  #isMeasured = false;
  #isWaiting = false;
  #wasPlaying = false;
  #decoded: ((packet: FramePacket) => void) | null = null;

  /** Throws DrawingError if the browser has no WebGL2. */
  constructor(canvas: HTMLCanvasElement, { controls = true }: PlayerOptions = {}) {
    super();
    this.#stage = new Stage(canvas, makeSorter(), {
      onShown: (packet, cost) => this.#takeShown(packet, cost),
      onRestored: () => void this.setFrame(this.#playing.frame ?? 0),
      onFault: (message) => this.#fail({ kind: "limit", message, rejectId: null, frame: null }),
    });
    this.#viewer = new Viewer(this.#stage, () => this.tell("view", null));
    this.#playing = new Playing(makeDecoder(), this.#stage, {
      onInfo: (info) => this.#takeInfo(info),
      onState: () => this.#takeState(),
      onEnded: () => this.tell("ended", null),
      onLiveEdge: (frame) => this.tell("liveedge", { frame }),
      onProgress: (bytes, byteLength) => {
        this.#recorder.receivedBytes = bytes;
        this.tell("progress", { bytes, byteLength });
      },
      onDecoded: (packet) => this.#takeDecoded(packet),
      onError: (fault) => this.#fail(fault),
    });
    this.#controls = controls ? new Controls(canvas, this.#viewer) : null;
  }

  /**
   * Open a stream and show a frame of it, by default the first. Another call replaces the stream.
   *
   * Rejects with a StreamError if the stream cannot be received or decoded that far.
   */
  open(source: StreamSource, { frame = null }: OpenOptions = {}): Promise<StreamInfo> {
    this.#isMeasured = false;
    this.#recorder.receivedBytes = 0;
    const opened = this.#pending.open();
    this.#playing.open(source, frame);
    this.#takeState();
    return opened;
  }

  play(): void {
    this.#playing.play();
  }

  pause(): void {
    this.#playing.pause();
  }

  /** Go to a time, seconds from the first frame; as `setFrame`. */
  seek(seconds: number): Promise<number | null> {
    const { info } = this;
    return this.setFrame(info === null ? seconds : info.firstFrame + Math.floor(seconds * rateOf(info) + 1e-6));
  }

  /**
   * Go to a frame by its ordinal; to the last one (for a live stream, the newest) if the stream ends before it.
   *
   * Resolves to the ordinal of the frame that is then shown. If another seek replaces this one, both resolve with its
   * frame. Rejects with a StreamError if the frame cannot be received or decoded. Resolves immediately to null if no
   * stream is open. Rejects with a RangeError if `frame` is NaN.
   */
  setFrame(frame: number): Promise<number | null> {
    if (Number.isNaN(frame)) {
      return Promise.reject(new RangeError("NaN is not the ordinal of a frame"));
    }
    this.#playing.setFrame(frame);
    return this.#sought();
  }

  /** Pause, and move by a number of frames; negative numbers go back. As `setFrame`. */
  step(by = 1): Promise<number | null> {
    this.#playing.step(by);
    return this.#sought();
  }

  /** Go to the newest frame of a live stream, or to the last one of any other. As `setFrame`. */
  seekToLiveEdge(): Promise<number | null> {
    return this.setFrame(Infinity);
  }

  /** Release the workers and the graphics card. The player cannot be used afterwards. */
  dispose(): void {
    this.#controls?.dispose();
    this.#playing.close();
    this.#stage.dispose();
  }

  /** The description of the stream; null before its first frame. */
  get info(): StreamInfo | null {
    return this.#playing.extent.info;
  }

  /** Ordinal of the frame that is shown; null before the first. */
  get frame(): number | null {
    return this.#playing.frame;
  }

  /** The frame that is shown or, during a seek, its target. */
  get targetFrame(): number | null {
    return this.#playing.target;
  }

  /** Ordinal after the last frame, if it is known. */
  get endFrame(): number | null {
    return this.#playing.extent.end;
  }

  /** Ordinal after the last decoded frame. */
  get bufferedTo(): number {
    return this.#playing.bufferedTo;
  }

  /** Seconds from the first frame to the current one. */
  get currentTime(): number {
    const { info, frame } = this;
    return info === null || frame === null ? 0 : (frame - info.firstFrame) / rateOf(info);
  }

  /** Seconds from the first frame to the end; null while unknown. */
  get duration(): number | null {
    const { info, endFrame } = this;
    return info === null || endFrame === null ? null : (endFrame - info.firstFrame) / rateOf(info);
  }

  /** Ordinal of the newest frame of a live stream; null if unknown, and at its end. */
  get liveEdge(): number | null {
    return this.#playing.extent.liveEdge;
  }

  /** Seconds from the current frame to the live edge; null if there is none. */
  get latency(): number | null {
    const { info } = this;
    const { framesBehind } = this.#playing;
    return info === null || framesBehind === null ? null : framesBehind / rateOf(info);
  }

  get isPlaying(): boolean {
    return this.#playing.isPlaying;
  }

  /** Whether playback waits for frames. */
  get isWaiting(): boolean {
    return this.#playing.isWaiting;
  }

  get loop(): boolean {
    return this.#playing.isLooping;
  }

  set loop(loop: boolean) {
    this.#playing.isLooping = loop;
  }

  /** Speed of playback; 1 is the speed of the capture. */
  get speed(): number {
    return this.#playing.speed;
  }

  set speed(speed: number) {
    if (!(speed > 0 && Number.isFinite(speed))) throw new RangeError(`the speed ${speed} is not positive`);
    this.#playing.speed = speed;
    this.#takeState();
  }

  /** Figures of the current frame; null before the first. */
  get statistics(): Statistics | null {
    return this.#recorder.read(this.#playing);
  }

  /** The cameras of the capture; if the stream has none, one that sees the whole scene. */
  get cameras(): readonly CaptureCamera[] {
    return this.#viewer.cameras;
  }

  /** Name of the camera of the view; null if the view has been moved. */
  get camera(): string | null {
    const { cameras, cameraIndex, isAtCamera } = this.#viewer;
    return isAtCamera ? (cameras[cameraIndex]?.name ?? null) : null;
  }

  /** Look through a camera. An unknown name changes nothing; null goes back to the last camera. */
  set camera(name: string | null) {
    this.#cameraWanted = name;
    const { cameras, cameraIndex } = this.#viewer;
    this.#viewer.lookThrough(name === null ? cameraIndex : cameras.findIndex((camera) => camera.name === name));
  }

  /** The axis that points up, about which the view orbits; null for the one of the stream. */
  get up(): Axis | null {
    return this.#viewer.axis;
  }

  set up(axis: Axis | null) {
    this.#viewer.axis = axis;
  }

  /** Turn the scene upside down: the up vector is negated. */
  flip(): void {
    this.#viewer.flip();
  }

  /**
   * Draw what a camera sees of the current frame, at the camera's size.
   *
   * Resolves to red, green and blue from 0 to 1, row by row. `float` blends in 32-bit floats, `bytes` in 8 bits, as on
   * the screen. Rejects with a DrawingError.
   */
  takePicture(camera: CaptureCamera, depth: Depth = "bytes"): Promise<Float32Array> {
    return this.#stage.takePicture(camera, depth);
  }

  /** Call a function with every decoded packet, before it is shown. */
  onDecoded(receive: (packet: FramePacket) => void): void {
    this.#decoded = receive;
  }

  /** Resolves when the current seek or step has shown its frame. */
  #sought(): Promise<number | null> {
    if (this.info === null || !this.#playing.isSeeking) return Promise.resolve(this.frame);
    return this.#pending.seek();
  }

  #takeInfo(info: StreamInfo): void {
    if (!this.#isMeasured) this.#viewer.begin(info, this.#cameraWanted);
    this.tell("info", info);
  }

  #takeDecoded(packet: FramePacket): void {
    const { info } = this;
    if (info !== null && !this.#isMeasured) {
      this.#isMeasured = true;
      this.#viewer.measure(packet, info);
    }
    this.#decoded?.(packet);
  }

  #takeShown(packet: FramePacket, cost: FrameCost): void {
    this.#playing.shown(packet);
    if (packet.isPreview) return this.tell("preview", null);
    this.#recorder.add(packet, cost);
    if (this.info !== null) this.#pending.resolveOpened(this.info);
    this.tell("frame", { frame: packet.frame });
    if (!this.#playing.isSeeking) this.#pending.resolveSeeks(packet.frame);
    this.#takeState();
  }

  #takeState(): void {
    const { isPlaying, isWaiting } = this.#playing;
    if (isPlaying !== this.#wasPlaying) {
      this.#wasPlaying = isPlaying;
      this.tell(isPlaying ? "play" : "pause", null);
    }
    if (isWaiting !== this.#isWaiting) {
      this.#isWaiting = isWaiting;
      this.tell("waiting", { isWaiting });
    }
  }

  #fail(fault: PlayerFault): void {
    this.#playing.pause();
    this.#pending.reject(fault);
    this.tell("error", fault);
  }
}
