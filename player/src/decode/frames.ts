/** Generates packets from any decoder that handles requests and sends replies. */

import type { DecodeReply, DecodeRequest, FramePacket, StreamInfo, StreamSource } from "../protocol.js";
import { StreamError } from "../stream-error.js";

const MAX_ORDINAL = 2 ** 32 - 1; // the decoder takes ordinals modulo 2^32

export interface FramesOptions {
  /** Ordinal of the first frame to generate; 0 by default. If the stream ends before, no frame is generated. */
  readonly from?: number;
  /** Called once with the description of the stream, before the first frame. */
  readonly onInfo?: (info: StreamInfo) => void;
  /** Ends the generator when it is aborted, also while it waits for the network or for the next frame of a live stream. */
  readonly signal?: AbortSignal;
}

/** A decoder in this thread or in a worker. */
export interface DecodeChannel {
  handle(request: DecodeRequest): void;
}

/**
 * Generate the packets of a stream in order of frames. Each packet contains the changes from the previous frame; the
 * first packet contains all Gaussians.
 *
 * Up to `framesAhead` frames are decoded before they are requested. Throws StreamError after the last frame before the
 * error, the reason of `signal` after it is aborted, and RangeError if `from` is NaN.
 */
export async function* generateFrames(
  connect: (onReply: (reply: DecodeReply) => void) => DecodeChannel,
  source: StreamSource,
  { from: firstFrame = 0, onInfo, signal }: FramesOptions,
  framesAhead: number,
): AsyncGenerator<FramePacket, void, void> {
  if (isNaN(firstFrame)) throw new RangeError(`${firstFrame} is not a frame`);
  let [run, isInfoReported] = [0, false];
  const replies: DecodeReply[] = [];
  let wakeUp = (): void => undefined;
  const channel = connect((reply) => {
    replies.push(reply);
    wakeUp();
  });
  const allowFrames = (frames: number): void => channel.handle({ kind: "more", frames, run });
  const nextPacket = async (): Promise<FramePacket | null> => {
    for (;;) {
      while (replies.length === 0 && signal?.aborted !== true) await new Promise<void>((resolve) => (wakeUp = resolve));
      signal?.throwIfAborted();
      const reply = replies.shift() as DecodeReply;
      if (reply.kind === "frame") {
        if (reply.packet.run === run && !reply.packet.isPreview) return reply.packet;
      } else if (reply.run !== run) continue;
      else if (reply.kind === "info" && !isInfoReported) {
        isInfoReported = true;
        onInfo?.(reply.info);
      } else if (reply.kind === "end") return null;
      else if (reply.kind === "error") throw new StreamError(reply.error);
    }
  };
  const handleAbort = (): void => wakeUp();
  signal?.addEventListener("abort", handleAbort);
  try {
    channel.handle({ kind: "open", source, run, readsIndexFirst: true });
    allowFrames(1 + (firstFrame === 0 ? framesAhead : 0));
    let packet = await nextPacket();
    if (firstFrame > (packet?.frame ?? Infinity)) {
      channel.handle({ kind: "seek", frame: Math.min(Math.ceil(firstFrame), MAX_ORDINAL), run: ++run });
      allowFrames(1 + framesAhead);
      packet = await nextPacket();
    }
    for (; packet !== null; packet = await nextPacket()) {
      yield packet;
      allowFrames(1);
    }
  } finally {
    signal?.removeEventListener("abort", handleAbort);
    channel.handle({ kind: "close" });
  }
}
