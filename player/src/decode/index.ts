/** The frames of a stream for programs, in Node or on a page, without a worker or a picture. */

import type { FramePacket, StreamInfo, StreamSource } from "../protocol.js";
import { StreamError } from "../stream-error.js";
import { Decoding } from "./decoding.js";

export type * from "../protocol.js";

export { StreamError };

export interface FramesOptions {
  /** Ordinal of the first frame to return; default 0. */
  readonly from?: number;
  /** Called once, before the first frame. */
  readonly onInfo?: (info: StreamInfo) => void;
}

/**
 * The frames of a stream in order, each as the changes to the one before; the first is full. The
 * next frame is decoded when it is asked for.
 *
 * Throws StreamError, after all frames before the fault.
 */
export async function* readFrames(
  source: StreamSource,
  { from = 0, onInfo }: FramesOptions = {},
): AsyncGenerator<FramePacket, void, void> {
  let resolve: (packet: FramePacket | null) => void = () => undefined;
  let reject: (error: StreamError) => void = () => undefined;
  const decoding = new Decoding((reply) => {
    if (reply.kind === "frame" && !reply.packet.isPreview) resolve(reply.packet);
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
    let packet = await next(() => decoding.take({ kind: "open", source, run, isIndexFirst: true }));
    if (from > (packet?.frame ?? Infinity)) {
      run = 1;
      packet = await next(() => decoding.take({ kind: "seek", frame: from, run }));
    }
    for (; packet !== null; packet = await next(() => undefined)) yield packet;
  } finally {
    decoding.take({ kind: "close" });
  }
}
