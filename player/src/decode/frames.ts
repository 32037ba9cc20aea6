/** Frames in order, from any decoder that handles requests and sends replies. */

import type { DecodeReply, DecodeRequest, FramePacket, StreamInfo, StreamSource } from "../protocol.js";
import { StreamError } from "../stream-error.js";

export interface FramesOptions {
  /** Ordinal of the first frame to return; default 0. */
  readonly from?: number;
  /** Called once, before the first frame. */
  readonly onInfo?: (info: StreamInfo) => void;
}

/** A decoder in this thread or in a worker. */
export interface DecodeChannel {
  take(request: DecodeRequest): void;
}

/**
 * The frames of a stream in order, each as the changes to the previous one; the first is complete.
 *
 * Up to `ahead` frames are decoded before they are requested. Throws StreamError, after returning all frames before the
 * error.
 */
export async function* generateFrames(
  connect: (receive: (reply: DecodeReply) => void) => DecodeChannel,
  source: StreamSource,
  { from = 0, onInfo }: FramesOptions,
  ahead: number,
): AsyncGenerator<FramePacket, void, void> {
  let [run, isTold] = [0, false];
  const replies: DecodeReply[] = [];
  let wake = (): void => undefined;
  const channel = connect((reply) => {
    replies.push(reply);
    wake();
  });
  const allow = (frames: number): void => channel.take({ kind: "more", frames, run });
  const next = async (): Promise<FramePacket | null> => {
    for (;;) {
      while (replies.length === 0) await new Promise<void>((resolve) => (wake = resolve));
      const reply = replies.shift() as DecodeReply;
      if (reply.kind === "frame") {
        if (reply.packet.run === run && !reply.packet.isPreview) return reply.packet;
      } else if (reply.run !== run) continue;
      else if (reply.kind === "info" && !isTold) {
        isTold = true;
        onInfo?.(reply.info);
      } else if (reply.kind === "end") return null;
      else if (reply.kind === "error") throw new StreamError(reply.error);
    }
  };
  try {
    channel.take({ kind: "open", source, run, isIndexFirst: true });
    allow(1 + (from === 0 ? ahead : 0));
    let packet = await next();
    if (from > (packet?.frame ?? Infinity)) {
      channel.take({ kind: "seek", frame: from, run: ++run });
      allow(1 + ahead);
      packet = await next();
    }
    for (; packet !== null; packet = await next()) {
      yield packet;
      allow(1);
    }
  } finally {
    channel.take({ kind: "close" });
  }
}
