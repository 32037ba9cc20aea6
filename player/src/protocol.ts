/**
 * The messages between the page, the decode worker and the sort worker.
 *
 * Gaussians live in **slots**. A Gaussian keeps its slot from birth to death, so that a packet
 * lists only the slots that a frame changed, however the rows of the state move (SPEC 7.1).
 * Values are the integers of the state; the vertex shader dequantizes them (SPEC 10.1).
 *
 * A packet that is not full changes the frame before it, so packets are applied in order.
 */

/** A capture camera (SPEC 5.6): a world point p is at R p + t, x right, y down, z ahead. */
export interface CaptureCamera {
  readonly name: string;
  /** Whether the encoder excluded it from training. */
  readonly isHeldOut: boolean;
  /** Pixels. */
  readonly width: number;
  readonly height: number;
  /** Focal lengths, pixels. */
  readonly fx: number;
  readonly fy: number;
  /** Principal point, pixels. */
  readonly cx: number;
  readonly cy: number;
  /** R, nine numbers row by row. */
  readonly rotation: readonly number[];
  /** t, world units. */
  readonly translation: readonly number[];
  /** Minimum visible depth, world units. */
  readonly near: number;
}

/** The header, the cameras and the extent of a stream. */
export interface StreamInfo {
  /** Ticks per second, and ticks per frame: a frame lasts `frameTicks / timescale` seconds. */
  readonly timescale: number;
  readonly frameTicks: number;
  /** A position in world units is its lattice units times 2^-latticeExponent. */
  readonly latticeExponent: number;
  readonly logScaleStep: number;
  readonly opacityStep: number;
  readonly shDcStep: number;
  readonly shRestStep: number;
  /** 0 or 1. */
  readonly shDegree: number;
  /** 0 unknown; 1 +x, 2 -x, 3 +y, 4 -y, 5 +z, 6 -z (SPEC 5.3). */
  readonly upAxis: number;
  readonly isRightHanded: boolean;
  /** Meters per world unit; 0 if unknown. */
  readonly metersPerUnit: number;
  readonly cameras: readonly CaptureCamera[];
  readonly metadata: Readonly<Record<string, string>>;
  /** Ordinal of the first frame. */
  readonly firstFrame: number;
  /** Number of frames; null while a live stream grows, and until the index has been read. */
  readonly frameCount: number | null;
  /** Ordinals of the canonical frames, at which a seek starts, if the stream has an index. */
  readonly canonicalFrames: readonly number[];
  /** Size of the stream in bytes, if known. */
  readonly byteLength: number | null;
  readonly isLive: boolean;
}

/** The changes of one frame. Arrays are transferred to the page, not shared. */
export interface FramePacket {
  /** Ordinal of the frame in the stream. */
  readonly frame: number;
  /** The opening or seek that the packet belongs to. Packets of older runs are dropped. */
  readonly run: number;
  /** Whether the packet replaces the previous frame: unlisted slots are then free. */
  readonly isFull: boolean;
  /**
   * Whether this is a part of a canonical frame that is still arriving and not yet verified by its CRC: a picture while
   * loading. Missing attributes are guessed.
   */
  readonly isPreview: boolean;
  /** Number of Gaussians in the frame. */
  readonly count: number;
  /** All slots in use are below this. */
  readonly slotLimit: number;
  /** [M] slots whose position or rotation changed, births included, ascending. */
  readonly movedSlots: Uint32Array;
  /** [M, 3] xyz, lattice units. */
  readonly positions: Int32Array;
  /** [M, 4] wxyz of unit quaternions with 22 fraction bits. */
  readonly rotations: Int32Array;
  /** [C] slots whose codes changed, births included, ascending. */
  readonly codedSlots: Uint32Array;
  /** [C, 7 or 16] log-scale 3, opacity 1, SH DC 3, SH rest 9 (SPEC 7.1). */
  readonly codes: Int16Array;
  /** [F] slots whose Gaussian died and that no birth reused, ascending. */
  readonly freedSlots: Uint32Array;
  /** Size of the frame's chunks in the stream; null if unknown, as right after a seek. */
  readonly bytes: number | null;
  /** Decode time in the worker, milliseconds. */
  readonly decodeMs: number;
  /** Whether the frame is canonical (CANO or SNAP), so that a seek can start at it. */
  readonly isCanonical: boolean;
}

/** From the page to the decode worker. */
export type DecodeRequest =
  | {
      readonly kind: "open";
      readonly source: StreamSource;
      readonly run: number;
      /** Whether to read the index before the first frame; default false. */
      readonly isIndexFirst?: boolean;
    }
  /** Continue at another frame; its packet is full. */
  | {
      readonly kind: "seek";
      readonly frame: number;
      readonly run: number;
      /** Whether the last frame is meant if the stream ends before the frame; default false. */
      readonly orLast?: boolean;
    }
  /** Allow more frames to be sent. */
  | { readonly kind: "more"; readonly frames: number; readonly run: number }
  | { readonly kind: "close" };

/** The source of a stream. `bytes` is transferred to the worker. */
export type StreamSource =
  | {
      readonly url: string;
      /** Whether the stream is still being written: it is then followed until it ends. */
      readonly isLive?: boolean;
      /** Request headers, such as Authorization. */
      readonly headers?: Readonly<Record<string, string>>;
    }
  | { readonly bytes: ArrayBuffer };

/** From the decode worker to the page. */
export type DecodeReply =
  /** Sent before the first packet, and again when the index has been read. */
  | { readonly kind: "info"; readonly info: StreamInfo; readonly run: number }
  | { readonly kind: "frame"; readonly packet: FramePacket }
  /** Number of bytes received so far. */
  | { readonly kind: "progress"; readonly bytes: number; readonly byteLength: number | null; readonly run: number }
  /** Ordinal of the newest frame of a live stream: its live edge. */
  | { readonly kind: "edge"; readonly frame: number; readonly run: number }
  | { readonly kind: "end"; readonly frameCount: number; readonly run: number }
  | { readonly kind: "error"; readonly error: PlayerFault; readonly run: number };

/** An error, as text for people, with the reject id if the stream is invalid. */
export interface PlayerFault {
  /** "rejected": the stream is invalid; "network"; "limit": exceeds this machine; "player": a bug. */
  readonly kind: "rejected" | "network" | "limit" | "player";
  readonly message: string;
  /** The reject id of SPEC 3.3; null unless `kind` is "rejected". */
  readonly rejectId: string | null;
  /** Ordinal of the frame that could not be decoded, if known. */
  readonly frame: number | null;
}

/** A viewing direction for sorting Gaussians: depth = forward . position. */
export type Direction = readonly [number, number, number];

/** From the page to the sort worker. `token` is returned with the reply. */
export type SortRequest =
  | { readonly kind: "frame"; readonly packet: SortPacket; readonly forward: Direction; readonly token: number }
  | { readonly kind: "view"; readonly forward: Direction; readonly token: number };

/** The part of a packet that the order depends on. */
export type SortPacket = Pick<
  FramePacket,
  "isFull" | "slotLimit" | "movedSlots" | "positions" | "freedSlots"
>;

/** From the sort worker to the page: the slots in use, farthest first. */
export interface SortReply {
  readonly token: number;
  readonly order: Uint32Array;
  readonly sortMs: number;
}
