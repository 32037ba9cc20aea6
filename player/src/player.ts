/**
 * The player for programs: draws a stream on a canvas and needs no other element.
 *
 *     const player = new Player(document.querySelector("canvas"));
 *     await player.open({ url: "steak.quarc" });
 *     player.play();
 */

import { openContext } from "./draw/painter.js";
import type { PixelFormat } from "./draw/picture.js";
import { Stage, type FrameCost } from "./draw/stage.js";
import { PendingPromises } from "./pending.js";
import type { OpenOptions, PlayerOptions } from "./player-options.js";
import { PlayerState } from "./player-state.js";
import { Playback } from "./playback.js";
import type { CaptureCamera, FramePacket, PlayerFault, StreamInfo, StreamSource } from "./protocol.js";
import { Sound } from "./sound.js";
import { frameRate, Recorder, type Statistics } from "./statistics.js";
import { makeFault } from "./stream-error.js";
import { Controls } from "./view/controls.js";
import type { Axis } from "./view/scene.js";
import { Viewer } from "./view/viewer.js";
import { Headset } from "./vr/headset.js";
import { makeSorter } from "./workers.js";

export class Player extends PlayerState {
  readonly #stage: Stage;
  readonly #playback: Playback;
  readonly #viewer: Viewer;
  readonly #controls: Controls | null;
  readonly #headset: Headset;
  readonly #sound: Sound;
  #recorder = new Recorder();
  readonly #pendingPromises = new PendingPromises();
  #requestedCamera: string | null = null;
  #isSceneMeasured = false;
  #isStoppedByError = false;
  #wasWaiting = false;
  #wasPlaying = false;
  #decodedListener: ((packet: FramePacket) => void) | null = null;

  /** Create a player on a canvas. Throws DrawingError if the browser has no WebGL2, or the canvas cannot be used. */
  constructor(canvas: HTMLCanvasElement, { controls = true, transparent = false }: PlayerOptions = {}) {
    super();
    this.#stage = new Stage(canvas, openContext(canvas, transparent), makeSorter, {
      onShown: (packet, cost) => this.#handleShown(packet, cost),
      onLost: () => this.#headset.handleContextLost(),
      onRestored: () => void this.setFrame(this.#playback.target ?? 0),
      onFault: (message) => this.#handleFault(makeFault("limit", message)),
    });
    // After the stage: without WebGL2, the listeners of the sound would never be removed.
    this.#sound = new Sound((failure) => {
      this.dispatch("settings", null);
      if (failure !== null) this.dispatch("audioerror", { message: failure });
    });
    this.#viewer = new Viewer(this.#stage, () => this.dispatch("view", null));
    this.#playback = new Playback(this.#stage, {
      onInfo: (info) => this.#handleInfo(info),
      onState: () => this.#handleStateChange(),
      onEnded: () => this.dispatch("ended", null),
      onLiveEdge: (frame) => this.dispatch("liveedge", { frame }),
      onProgress: (bytes, byteLength) => {
        this.#recorder.receivedBytes = bytes;
        this.dispatch("progress", { bytes, byteLength });
      },
      onDecoded: (packet) => this.#handleDecoded(packet),
      onError: (fault) => this.#handleFault(fault),
    });
    this.#controls = controls ? new Controls(canvas, this.#viewer) : null;
    this.#headset = new Headset(this.#stage, this.#viewer, transparent, {
      onChange: () => this.dispatch("headset", { isInHeadset: this.isInHeadset }),
      onSelect: () => (this.isPlaying ? this.pause() : this.play()),
    });
  }

  /**
   * Open a stream and show one frame, by default the first. Another call replaces the stream; both then resolve or reject
   * like the later call.
   *
   * Resolves when the frame is shown. Rejects with a StreamError if the stream cannot be received or decoded up to that
   * frame. Throws a DataCloneError, and keeps the stream that is open, if the bytes were opened before.
   */
  open(source: StreamSource, { frame = null }: OpenOptions = {}): Promise<StreamInfo> {
    this.#playback.open(source, frame);
    this.#isSceneMeasured = false;
    this.#recorder = new Recorder();
    const promise = this.#pendingPromises.waitForOpen();
    this.#handleStateChange();
    return promise;
  }

  play(): void {
    this.#playback.play();
  }

  pause(): void {
    this.#playback.pause();
  }

  /** Seek to a time, in seconds from the first frame. Resolves and rejects like `setFrame`. */
  seek(seconds: number): Promise<number | null> {
    return this.setFrame(this.findFrame(seconds));
  }

  /**
   * Seek to a frame by its ordinal; if the stream ends earlier, to its last frame (in a live stream, its newest frame).
   *
   * Resolves to the ordinal of the frame that is then shown. If a later seek replaces this one, both resolve to the
   * frame of the later seek. Rejects with a StreamError if the frame cannot be received or decoded. Resolves immediately
   * to null if no stream is open. Rejects with a RangeError if `frame` is NaN.
   */
  setFrame(frame: number): Promise<number | null> {
    return this.#seek(frame, () => this.#playback.setFrame(frame));
  }

  /** Pause, and move by `count` frames; negative numbers move back. Resolves and rejects like `setFrame`. */
  step(count = 1): Promise<number | null> {
    return this.#seek(count, () => this.#playback.step(count));
  }

  /** Seek to the newest frame of a live stream, or to the last frame of any other stream. Resolves like `setFrame`. */
  seekToLiveEdge(): Promise<number | null> {
    return this.setFrame(Infinity);
  }

  /**
   * Stop the workers, release the graphics memory, and reject all pending promises. The player cannot be used
   * afterwards; promises of later calls reject, too. Another player can use the canvas only if it is on the page now.
   */
  dispose(): void {
    this.pause();
    this.#controls?.dispose();
    this.#headset.dispose();
    this.#sound.dispose();
    this.#playback.close();
    this.#stage.dispose();
    this.#pendingPromises.close(makeFault("player", "the player was disposed"));
  }

  /** Whether the last error has stopped playback. */
  get isStoppedByError(): boolean {
    return this.#isStoppedByError;
  }

  /** Statistics of the current frame and of playback; null before the first frame. */
  get statistics(): Statistics | null {
    return this.#recorder.read(this.#playback);
  }

  /** The cameras of the capture; if the stream has no cameras, one camera that sees the whole scene. */
  get cameras(): readonly CaptureCamera[] {
    return this.#viewer.cameras;
  }

  /** Name of the camera of the view; null if the view has been moved. */
  get camera(): string | null {
    const { cameras, cameraIndex, isAtCamera } = this.#viewer;
    return isAtCamera ? (cameras[cameraIndex]?.name ?? null) : null;
  }

  /**
   * Select a camera by name; while a stream is being opened, for its first picture. An unknown name changes nothing; null
   * returns to the last selected camera.
   */
  set camera(name: string | null) {
    this.#requestedCamera = name;
    if (this.info === null) return; // the picture of the previous stream stays as it is
    const { cameras, cameraIndex } = this.#viewer;
    this.#viewer.lookThrough(name === null ? cameraIndex : cameras.findIndex((camera) => camera.name === name));
    this.#headset.placeAgain();
  }

  /** The axis that points up, about which the view orbits; null for the up axis of the stream. */
  get up(): Axis | null {
    return this.#viewer.axis;
  }

  set up(axis: Axis | null) {
    this.#viewer.axis = axis;
    this.#headset.placeAgain();
  }

  /** Turn the scene upside down by negating the up vector. */
  flip(): void {
    this.#viewer.flip();
    this.#headset.placeAgain();
  }

  /** Whether the scene is shown in a headset instead of on the canvas. */
  get isInHeadset(): boolean {
    return this.#headset.isActive;
  }

  /**
   * Show the scene in a headset (WebXR), from the current view. Browsers require that the user has just pressed a button
   * or key. The scene has its true size if the stream states its scale; otherwise the pivot is 2 m away.
   *
   * Resolves when the headset shows the scene. Rejects with a DrawingError or DOMException if no headset can be used, or if
   * `leaveHeadset` is called before.
   */
  enterHeadset(): Promise<void> {
    return this.#headset.enter();
  }

  /** Return from the headset to the view before. */
  leaveHeadset(): Promise<void> {
    return this.#headset.leave();
  }

  /**
   * Draw the current frame from a camera, at the camera's size.
   *
   * Resolves to [height, width, 3] red, green and blue, from 0 to 1. The format `float` blends in 32-bit floats; `bytes`
   * blends in 8 bits, as on the screen. Rejects with a RangeError if the size of the camera is invalid or too large for
   * the graphics card, and with a DrawingError if the picture cannot be drawn for another reason.
   */
  takePicture(camera: CaptureCamera, format: PixelFormat = "bytes"): Promise<Float32Array> {
    return this.#stage.takePicture(camera, format);
  }

  /**
   * Set a function that is called with every decoded packet, before the packet is shown. It replaces the function that was
   * set before; `<quarc-player>` has set one, without which its timeline stays empty.
   */
  onDecoded(listener: (packet: FramePacket) => void): void {
    this.#decodedListener = listener;
  }

  protected override get playback(): Playback {
    return this.#playback;
  }

  protected override get sound(): Sound {
    return this.#sound;
  }

  /** Begin a seek or step; resolves to the ordinal of the frame that it shows, or to null if no stream is open. */
  #seek(target: number, begin: () => void): Promise<number | null> {
    // Not Number.isNaN: in JavaScript, it may also be undefined, or a text that is not a number.
    if (isNaN(target)) return Promise.reject(new RangeError(`${target} is not a frame`));
    const promise = this.#pendingPromises.waitForSeek(); // before a step to a damaged frame, which fails at once
    begin();
    const { isSeeking, frame } = this.#playback;
    if (this.info === null || !isSeeking) this.#pendingPromises.resolveSeeks(frame);
    return promise;
  }

  #handleInfo(info: StreamInfo): void {
    this.#stage.update(info);
    if (this.#isSceneMeasured) this.#viewer.update(info, this.#requestedCamera);
    else this.#viewer.begin(info, this.#requestedCamera);
    this.dispatch("info", info);
  }

  #handleDecoded(packet: FramePacket): void {
    const { info } = this;
    if (info !== null && !this.#isSceneMeasured) {
      this.#isSceneMeasured = true;
      this.#viewer.measure(packet, info);
      this.#headset.placeAgain();
    }
    this.#decodedListener?.(packet);
  }

  #handleShown(packet: FramePacket, cost: FrameCost): void {
    this.#playback.noteShown(packet);
    const { info } = this;
    if (info === null) return; // the frame belongs to the previous stream
    if (packet.isPreview) return this.dispatch("preview", null);
    this.#recorder.add(packet, cost);
    this.#pendingPromises.resolveOpen(info);
    this.#followPicture();
    this.dispatch("frame", { frame: packet.frame });
    this.#handleStateChange();
  }

  /** Let the sound follow the picture. */
  #followPicture(): void {
    const { info, frame, speed } = this;
    if (info === null || frame === null) return;
    const durationSeconds = 1 / frameRate(info);
    const isPlaying = this.isPlaying && !this.#playback.isSeeking;
    this.#sound.follow({ seconds: frame * durationSeconds, durationSeconds, speed, isPlaying });
  }

  #handleStateChange(): void {
    const { isPlaying, isWaiting, isSeeking, frame } = this.#playback;
    if (!isSeeking && frame !== null) this.#pendingPromises.resolveSeeks(frame);
    if (isPlaying !== this.#wasPlaying) {
      this.#wasPlaying = isPlaying;
      this.#followPicture();
      this.dispatch(isPlaying ? "play" : "pause", null);
    }
    if (isWaiting !== this.#wasWaiting) {
      this.#wasWaiting = isWaiting;
      this.dispatch("waiting", { isWaiting });
    }
  }

  #handleFault(fault: PlayerFault): void {
    this.#isStoppedByError = this.isPlaying;
    this.#playback.pause();
    this.#pendingPromises.rejectAll(fault);
    this.#handleStateChange();
    this.dispatch("error", fault);
  }
}
