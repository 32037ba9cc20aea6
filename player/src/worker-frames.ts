/** Decoding in a worker, for pages with another renderer. */

import { generateFrames, type DecodeChannel, type FramesOptions } from "./decode/frames.js";
import type { DecodeReply, FramePacket, StreamSource } from "./protocol.js";
import { describeWorkerError, makeDecoder, sendRequest } from "./workers.js";

const FRAMES_AHEAD = 3;

/**
 * Generate the packets of a stream in order of frames. Each packet contains the changes from the previous frame; the
 * first packet contains all Gaussians. A worker decodes a few frames ahead of the requested frame.
 *
 * Throws StreamError after the last frame before the error, and the reason of `signal` after it is aborted.
 */
export function readFrames(
  source: StreamSource,
  options: FramesOptions = {},
): AsyncGenerator<FramePacket, void, void> {
  return generateFrames(startDecoder, source, options, FRAMES_AHEAD);
}

function startDecoder(onReply: (reply: DecodeReply) => void): DecodeChannel {
  const worker = makeDecoder();
  let run = 0;
  worker.onmessage = ({ data }) => onReply(data as DecodeReply);
  worker.onerror = (event) => onReply({ kind: "error", error: describeWorkerError(event), run });
  return {
    handle(request) {
      if ("run" in request) run = request.run;
      sendRequest(worker, request); // on "close", the worker terminates itself
    },
  };
}
