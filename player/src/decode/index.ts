/** Frames of a stream for programs, in Node or in a page, without a worker or a picture. */

import type { FramePacket, PlayerFault, StreamInfo, StreamSource } from "../protocol.js";
import { Decoding } from "./decoding.js";

export type * from "../protocol.js";

/** A stream that cannot be had, or not be decoded; `fault` says why. */
export class StreamError extends Error {
  override readonly name = "StreamError";
  constructor(readonly fault: PlayerFault) {
    super(fault.message);
  }
}

export interface FramesOptions {
  /** Ordinal of the first frame that is wanted. */
  readonly from?: number;
  /** Told once, before the first frame. */
  readonly onInfo?: (info: StreamInfo) => void;
}

/**
 * The frames of a stream, one after the other, each as what it changed of the one before. The next
 * is decoded when it is asked for.
 *
 * Throws StreamError; the frames before the fault have been given out.
 */
export async function* readFrames(
  source: StreamSource,
  { from = 0, onInfo }: FramesOptions = {},
): AsyncGenerator<FramePacket, void, void> {
  let resolve: (packet: FramePacket | null) => void = () => undefined;
  let reject: (error: StreamError) => void = () => undefined;
  const decoding = new Decoding((reply) => {
    if (reply.kind === "frame") resolve(reply.packet);
    else if (reply.kind === "info") onInfo?.(reply.info);
    else if (reply.kind === "end") resolve(null);
    else if (reply.kind === "error") reject(new StreamError(reply.error));
  });
  let run = 0;
  const next = (ask: () => void): Promise<FramePacket | null> =>
    new Promise((yes, no) => {
      [resolve, reject] = [yes, no];
      ask();
      decoding.take({ kind: "more", frames: 1, run });
    });
  try {
    let packet = await next(() => decoding.take({ kind: "open", source, run }));
    if (from > (packet?.frame ?? Infinity)) {
      run = 1;
      packet = await next(() => decoding.take({ kind: "seek", frame: from, run }));
    }
    for (; packet !== null; packet = await next(() => undefined)) yield packet;
  } finally {
    decoding.take({ kind: "close" });
  }
}
