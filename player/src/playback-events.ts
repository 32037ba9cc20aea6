/** The interfaces between playback and the player. */

import type { FramePacket, PlayerFault, StreamInfo } from "./protocol.js";

/** A screen that shows frames, one at a time. */
export interface Screen {
  readonly isBusy: boolean;
  readonly isInHeadset: boolean;
  begin(info: StreamInfo): void;
  /** Show a frame; its Gaussians move there from the previous frame in `motionMs`. */
  show(packet: FramePacket, motionMs?: number): void;
  /** End the motion to the current frame. */
  finishMotion(): void;
}

export interface PlaybackEvents {
  onInfo(info: StreamInfo): void;
  /** Playback has started, stopped or begun to wait, or the end of the stream has become known. */
  onState(): void;
  onEnded(): void;
  onProgress(bytes: number, byteLength: number | null): void;
  /** A live stream has grown, or its newest frame has become known. */
  onLiveEdge(frame: number): void;
  /** A frame has been decoded; it will be shown, unless a seek comes first. */
  onDecoded(packet: FramePacket): void;
  onError(fault: PlayerFault): void;
}
