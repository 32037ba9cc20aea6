/**
 * The messages between the page, the decode worker and the sort worker.
 *
 * Each Gaussian has a **slot**, which it keeps from birth to death. So a packet lists only the slots that a frame
 * changes, although the rows of the state move (SPEC 7.1). Values are the integers of the state; the vertex shader
 * dequantizes them (SPEC 10.1).
 *
 * A packet that is not full contains the changes from the previous frame. So packets must be applied in order.
 */

/** A capture camera (SPEC 5.6): the camera coordinates of a world point p are R p + t, with x right, y down, z ahead. */
export interface CaptureCamera {
  readonly name: string;
  /** Whether the encoder excluded the camera from training. */
  readonly isHeldOut: boolean;
  /** Size of the picture, pixels. */
  readonly width: number;
  readonly height: number;
  /** Focal lengths, pixels. */
  readonly fx: number;
  readonly fy: number;
  /** Principal point, pixels. */
  readonly cx: number;
  readonly cy: number;
  /** [3, 3] the rotation R, row by row. */
  readonly rotation: readonly number[];
  /** [3] the translation t, world units. */
  readonly translation: readonly number[];
  /** Minimum visible depth, world units. */
  readonly near: number;
}

/** The header, the cameras, the metadata and the range of frames of a stream. */
export interface StreamInfo {
  /** Ticks per second, and ticks per frame: a frame lasts `frameTicks / timescale` seconds. */
  readonly timescale: number;
  readonly frameTicks: number;
  /** A lattice unit is 2^-latticeExponent world units. */
  readonly latticeExponent: number;
  readonly logScaleStep: number;
  readonly opacityStep: number;
  readonly shDcStep: number;
  readonly shRestStep: number;
  /** Degree of the spherical harmonics: 0 or 1. */
  readonly shDegree: number;
  /** The axis that points up: 0 unknown, 1 +x, 2 -x, 3 +y, 4 -y, 5 +z, 6 -z (SPEC 5.3). */
  readonly upAxis: number;
  readonly isRightHanded: boolean;
  /** Meters per world unit; 0 if unknown. */
  readonly metersPerUnit: number;
  readonly cameras: readonly CaptureCamera[];
  readonly metadata: Readonly<Record<string, string>>;
  /** Ordinal of the first frame. */
  readonly firstFrame: number;
  /** Number of frames; null until the index has been read, and while a live stream grows. */
  readonly frameCount: number | null;
  /** Ordinals of the canonical frames, at which a seek can start; empty until the index has been read. */
  readonly canonicalFrames: readonly number[];
  /** Size of the stream in bytes; null if unknown. */
  readonly byteLength: number | null;
  /** Whether the stream was opened as a live stream. */
  readonly isLive: boolean;
}

/** The changes that a frame makes. Its arrays are transferred to the page, not shared. */
export interface FramePacket {
  /** Ordinal of the frame in the stream. */
  readonly frame: number;
  /** Number of the run, that is the opening or seek, that decoded the frame. Packets of older runs are dropped. */
  readonly run: number;
  /** Whether the packet contains all Gaussians of the frame; unlisted slots are then free. */
  readonly isFull: boolean;
  /**
   * Whether this is a preview of a canonical frame that is still arriving, so that its CRC is not checked yet. Missing
   * attributes are guessed.
   */
  readonly isPreview: boolean;
  /** Number of Gaussians in the frame. */
  readonly count: number;
  /** Number of slots, used or free; all slots are below it. */
  readonly slotLimit: number;
  /** [M] slots whose position or rotation changed, births included, ascending. */
  readonly movedSlots: Uint32Array;
  /** [M, 3] xyz, lattice units. */
  readonly positions: Int32Array;
  /** [M, 4] wxyz unit quaternions, with 22 fraction bits. */
  readonly rotations: Int32Array;
  /** [C] slots whose codes changed, births included, ascending. */
  readonly codedSlots: Uint32Array;
  /** [C, 7 or 16] log-scale 3, opacity 1, SH DC 3, SH rest 9 (SPEC 7.1). */
  readonly codes: Int16Array;
  /** [F] slots whose Gaussians were deleted and which no birth reused, ascending. */
  readonly freedSlots: Uint32Array;
  /** [B] slots whose Gaussians were born in this frame, ascending; empty if `isFull`. */
  readonly bornSlots: Uint32Array;
  /** Size of the frame in the stream, bytes; null if unknown, such as directly after a seek. */
  readonly bytes: number | null;
  /** Decode time in the worker, milliseconds. */
  readonly decodeMs: number;
  /** Whether the frame is canonical (CANO or SNAP), so that a seek can start at it. */
  readonly isCanonical: boolean;
}

/** A message from the page to the decode worker. */
export type DecodeRequest =
  | {
      readonly kind: "open";
      readonly source: StreamSource;
      readonly run: number;
      /** Whether to read the index before the first frame; false by default. */
      readonly readsIndexFirst?: boolean;
    }
  /** Continue at another frame, whose packet is full. */
  | {
      readonly kind: "seek";
      readonly frame: number;
      readonly run: number;
      /** Whether to use the last frame if the stream ends before the requested frame; false by default. */
      readonly clampToLast?: boolean;
    }
  /** Allow `frames` more frames to be sent. */
  | { readonly kind: "more"; readonly frames: number; readonly run: number }
  | { readonly kind: "close" };

/** The source of a stream; the buffer `bytes` is transferred to the worker. */
export type StreamSource =
  | {
      readonly url: string;
      /** Whether the stream is still being written; the player then follows it until it ends. */
      readonly isLive?: boolean;
      /** Request headers, such as Authorization. */
      readonly headers?: Readonly<Record<string, string>>;
    }
  | { readonly bytes: ArrayBuffer };

/** A message from the decode worker to the page. */
export type DecodeReply =
  /** The description of the stream: sent before the first packet, and again when it has changed. */
  | { readonly kind: "info"; readonly info: StreamInfo; readonly run: number }
  | { readonly kind: "frame"; readonly packet: FramePacket }
  /** Number of bytes received so far. */
  | { readonly kind: "progress"; readonly bytes: number; readonly byteLength: number | null; readonly run: number }
  /** Ordinal of the newest frame of a live stream (the live edge). */
  | { readonly kind: "edge"; readonly frame: number; readonly run: number }
  | { readonly kind: "end"; readonly frameCount: number; readonly run: number }
  | { readonly kind: "error"; readonly error: PlayerFault; readonly run: number };

/** Posts a reply, and transfers the listed buffers with it. */
export type PostReply = (reply: DecodeReply, transferList: ArrayBuffer[]) => void;

/** An error: its kind, a message for the user, and the reject id if the stream is invalid. */
export interface PlayerFault {
  /**
   * "rejected": invalid stream; "empty": stream without frames; "network": stream not received, or
   * changed on the server; "limit": too much for this machine; "player": the player has been disposed, or has a bug.
   */
  readonly kind: "rejected" | "empty" | "network" | "limit" | "player";
  readonly message: string;
  /** The reject id of SPEC 3.3; null unless `kind` is "rejected". */
  readonly rejectId: string | null;
  /** Ordinal of the frame that could not be decoded, if known. */
  readonly frame: number | null;
}

/** A viewing direction for sorting Gaussians: the depth of a Gaussian is the dot product of direction and position. */
export type Direction = readonly [number, number, number];

/** A message from the page to the sort worker; the reply has the same `token`. */
export type SortRequest =
  | { readonly kind: "frame"; readonly packet: SortPacket; readonly forward: Direction; readonly token: number }
  | { readonly kind: "view"; readonly forward: Direction; readonly token: number };

/** The fields of a packet on which the drawing order depends. */
export type SortPacket = Pick<
  FramePacket,
  "isFull" | "slotLimit" | "movedSlots" | "positions" | "freedSlots"
>;

/** A message from the sort worker to the page; `order` lists the used slots, farthest first. */
export interface SortReply {
  readonly token: number;
  readonly order: Uint32Array;
  readonly sortMs: number;
}
