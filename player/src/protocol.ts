/**
 * What the decode worker, the sort worker and the page say to each other.
 *
 * Gaussians live in **slots**. A Gaussian keeps its slot from birth to death, so that a frame
 * carries only the slots that changed, whatever happens to the rows of the state (SPEC 7.1).
 * Numbers are the integers of the state; the shader dequantizes them (SPEC 10.1).
 *
 * A packet that is not full changes the frame before it. The page applies packets in the order in
 * which they come.
 */

/** A capture camera (SPEC 5.6): a point p of the world is at R p + t, x right, y down, z ahead. */
export interface CaptureCamera {
  readonly name: string;
  /** Whether the encoder left it out of training. */
  readonly isHeldOut: boolean;
  /** Pixels. */
  readonly width: number;
  readonly height: number;
  readonly fx: number;
  readonly fy: number;
  readonly cx: number;
  readonly cy: number;
  /** R, row by row. */
  readonly rotation: readonly number[];
  /** t, world units. */
  readonly translation: readonly number[];
  /** Least depth of what the camera sees, world units. */
  readonly near: number;
}

/** What a stream says of itself before its first frame. */
export interface StreamInfo {
  /** Ticks per second, and ticks per frame: a frame lasts `frameTicks / timescale` seconds. */
  readonly timescale: number;
  readonly frameTicks: number;
  /** Position = lattice units * 2^-latticeExponent, world units. */
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
  /** 0 where unknown. */
  readonly metersPerUnit: number;
  readonly cameras: readonly CaptureCamera[];
  readonly metadata: Readonly<Record<string, string>>;
  /** Ordinal of the first frame. */
  readonly firstFrame: number;
  /** Number of frames; null while a live stream grows, or before an index has been read. */
  readonly frameCount: number | null;
  /** Ordinals of canonical frames, where an index lists them: frames that a seek starts at. */
  readonly canonicalFrames: readonly number[];
  /** Bytes of the stream, where the server says. */
  readonly byteLength: number | null;
  readonly isLive: boolean;
}

/** Everything that a frame changed. Arrays are transferred, never shared. */
export interface FramePacket {
  /** Ordinal of the frame in the stream. */
  readonly frame: number;
  /** Counts seeks and openings: packets of an older run are dropped. */
  readonly run: number;
  /** Nothing of the frame before is kept: all slots that are not listed are free. */
  readonly isFull: boolean;
  /** Gaussians of the frame. */
  readonly count: number;
  /** All slots in use are below this. */
  readonly slotLimit: number;
  /** [M] ascending slots whose position or rotation changed, births among them. */
  readonly movedSlots: Uint32Array;
  /** [M, 3] xyz, lattice units. */
  readonly positions: Int32Array;
  /** [M, 4] wxyz of a unit quaternion, 22 fraction bits. */
  readonly rotations: Int32Array;
  /** [C] ascending slots whose codes changed, births among them. */
  readonly codedSlots: Uint32Array;
  /** [C, 7 or 16] log-scale 3, opacity 1, SH DC 3, SH rest 9 (SPEC 7.1). */
  readonly codes: Int16Array;
  /** [F] ascending slots whose Gaussian died and that no birth took. */
  readonly freedSlots: Uint32Array;
  /** Bytes of the frame's chunks in the stream. */
  readonly bytes: number;
  /** Milliseconds of the worker that decoding took. */
  readonly decodeMs: number;
  /** A canonical frame or a snapshot: a frame that a seek can start at. */
  readonly isCanonical: boolean;
}

/** Gaussians of a canonical frame that is still on its way: a picture while loading. */
export interface PartialScene {
  readonly run: number;
  /** [K, 3] lattice units. */
  readonly positions: Int32Array;
  /** [K, 7] codes; those that have not come are guessed. */
  readonly codes: Int16Array;
}

/** Page to decode worker. */
export type DecodeRequest =
  | { readonly kind: "open"; readonly source: StreamSource; readonly run: number }
  /** Go to a frame: the next packet is full. */
  | { readonly kind: "seek"; readonly frame: number; readonly run: number }
  /** The page has taken frames off its ring: so many more may be sent. */
  | { readonly kind: "more"; readonly frames: number; readonly run: number }
  | { readonly kind: "close" };

/** Where a stream comes from. */
export type StreamSource =
  | { readonly url: string; readonly isLive?: boolean; readonly headers?: Readonly<Record<string, string>> }
  | { readonly bytes: ArrayBuffer };

/** Decode worker to page. */
export type DecodeReply =
  | { readonly kind: "info"; readonly info: StreamInfo; readonly run: number }
  | { readonly kind: "partial"; readonly scene: PartialScene }
  | { readonly kind: "frame"; readonly packet: FramePacket }
  /** Bytes that have come so far, and how far (in frames) a seek needs no waiting. */
  | { readonly kind: "progress"; readonly bytes: number; readonly byteLength: number | null; readonly run: number }
  | { readonly kind: "end"; readonly frameCount: number; readonly run: number }
  | { readonly kind: "error"; readonly error: PlayerFault; readonly run: number };

/** What went wrong, in words for people, and by SPEC 3.3 where the stream is at fault. */
export interface PlayerFault {
  /** "rejected": the stream; "network": its way here; "limit": this machine; "player": a bug. */
  readonly kind: "rejected" | "network" | "limit" | "player";
  readonly message: string;
  /** The reject id of SPEC 3.3. */
  readonly rejectId: string | null;
  /** The frame that could not be had. */
  readonly frame: number | null;
}

/** A direction of sight, for sorting: depth = forward . (position of the world) in lattice units. */
export type Direction = readonly [number, number, number];

/** Page to sort worker. `places` is a packet's positions, copied, where the frame is a new one. */
export type SortRequest =
  | { readonly kind: "frame"; readonly packet: SortPacket; readonly forward: Direction }
  | { readonly kind: "view"; readonly forward: Direction }
  | { readonly kind: "close" };

/** The part of a packet that the order depends on. */
export interface SortPacket {
  readonly frame: number;
  readonly run: number;
  readonly isFull: boolean;
  readonly slotLimit: number;
  readonly movedSlots: Uint32Array;
  readonly positions: Int32Array;
  readonly freedSlots: Uint32Array;
}

/** Sort worker to page: slots in use of a frame, farthest first. */
export interface SortReply {
  readonly kind: "order";
  readonly frame: number;
  readonly run: number;
  readonly order: Uint32Array;
  readonly forward: Direction;
  readonly sortMs: number;
}
