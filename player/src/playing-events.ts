/** The interfaces that playback needs. */

import type { FramePacket, PlayerFault, StreamInfo } from "./protocol.js";

/** A screen that shows frames. */
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
  /** A live stream has grown, or its extent has become known. */
  onLiveEdge(frame: number): void;
  /** A frame has been decoded; it will be shown, unless a seek comes first. */
  onDecoded(packet: FramePacket): void;
  onError(fault: PlayerFault): void;
}
