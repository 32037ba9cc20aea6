/** What playback needs of its surroundings. */

import type { FramePacket, PlayerFault, StreamInfo } from "./protocol.js";

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
