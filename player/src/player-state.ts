/** The state of a player: the position in the stream, the audio, and the settings. */

import type { Playback } from "./playback.js";
import { PlayerEventTarget } from "./player-events.js";
import type { StreamInfo } from "./protocol.js";
import type { AudioState, Sound } from "./sound.js";
import { frameRate } from "./statistics.js";

export abstract class PlayerState extends PlayerEventTarget {
  protected abstract get playback(): Playback;
  protected abstract get sound(): Sound;

  /** The description of the stream; null before its first frame. */
  get info(): StreamInfo | null {
    return this.playback.extent.info;
  }

  /** Ordinal of the frame that is shown; null before the first frame is shown. */
  get frame(): number | null {
    return this.playback.frame;
  }

  /** Ordinal of the frame that is shown or, during a seek, of the seek's target. */
  get targetFrame(): number | null {
    return this.playback.target;
  }

  /** Ordinal after the last frame; null if unknown. */
  get endFrame(): number | null {
    return this.playback.extent.endFrame;
  }

  /** Ordinal after the last decoded frame. */
  get bufferedTo(): number {
    return this.playback.bufferedTo;
  }

  /** Seconds from the first frame to the current frame. */
  get currentTime(): number {
    const { info, frame } = this;
    return info === null || frame === null ? 0 : (frame - info.firstFrame) / frameRate(info);
  }

  /** Seconds from the first frame to the end; null while the end is unknown. */
  get duration(): number | null {
    const { info, endFrame } = this;
    return info === null || endFrame === null ? null : (endFrame - info.firstFrame) / frameRate(info);
  }

  /** Ordinal of the newest frame of a live stream; null if unknown, and after the stream has ended. */
  get liveEdge(): number | null {
    return this.playback.extent.liveEdge;
  }

  /** Seconds from the current frame to the newest frame of a live stream; null if `liveEdge` is null. */
  get latency(): number | null {
    const { info } = this;
    const { framesBehind } = this.playback;
    return info === null || framesBehind === null ? null : framesBehind / frameRate(info);
  }

  get isPlaying(): boolean {
    return this.playback.isPlaying;
  }

  /** Whether playback waits for frames. */
  get isWaiting(): boolean {
    return this.playback.isWaiting;
  }

  get loop(): boolean {
    return this.playback.isLooping;
  }

  set loop(loop: boolean) {
    this.playback.isLooping = loop;
    this.dispatch("settings", null);
  }

  /** Speed of playback; 1 is the speed of the capture. */
  get speed(): number {
    return this.playback.speed;
  }

  set speed(speed: number) {
    if (!(speed > 0 && Number.isFinite(speed))) throw new RangeError(`the speed ${speed} is not positive`);
    this.playback.speed = speed;
    this.dispatch("settings", null);
  }

  /** Address of an audio file that plays in sync with the pictures; null for none. */
  get audio(): string | null {
    return this.sound.url;
  }

  set audio(url: string | null) {
    this.sound.url = url;
  }

  /** Time in the audio file of the frame with ordinal 0, seconds; may be negative. */
  get audioStart(): number {
    return this.sound.start;
  }

  set audioStart(seconds: number) {
    this.sound.start = seconds;
    this.dispatch("settings", null);
  }

  /** Whether there is audio, whether the browser blocks it until the next click or key, and whether it has failed. */
  get audioState(): AudioState {
    return this.sound.state;
  }

  get muted(): boolean {
    return this.sound.element.muted;
  }

  set muted(muted: boolean) {
    this.sound.element.muted = muted;
  }

  /** Volume of the audio, from 0 to 1. */
  get volume(): number {
    return this.sound.element.volume;
  }

  set volume(volume: number) {
    this.sound.element.volume = volume;
  }

  /** Return the ordinal of the frame at a time, in seconds from the first frame. */
  protected findFrame(seconds: number): number {
    const { info } = this;
    return info === null ? seconds : info.firstFrame + Math.floor(seconds * frameRate(info) + 1e-6);
  }
}
