/** The frames of a stream for pages with their own renderer. */

import { generateFrames, type DecodeChannel, type FramesOptions } from "./decode/frames.js";
import type { DecodeReply, FramePacket, StreamSource } from "./protocol.js";
import { makeDecoder } from "./workers.js";

const AHEAD = 3;

/**
 * The frames of a stream in order, each as the changes to the previous one; the first is complete. A worker decodes
 * them, a few ahead of the requested one.
 *
 * Throws StreamError, after returning all frames before the error.
 */
export function readFrames(
  source: StreamSource,
  options: FramesOptions = {},
): AsyncGenerator<FramePacket, void, void> {
  // The worker cannot resolve relative addresses.
  const absolute = "url" in source ? { ...source, url: new URL(source.url, document.baseURI).href } : source;
  return generateFrames(startDecoder, absolute, options, AHEAD);
}

function startDecoder(receive: (reply: DecodeReply) => void): DecodeChannel {
  const worker = makeDecoder();
  let run = 0;
  worker.onmessage = ({ data }) => receive(data as DecodeReply);
  worker.onerror = ({ message }) => {
    const text = message || "the decoder could not be started";
    receive({ kind: "error", error: { kind: "player", message: text, rejectId: null, frame: null }, run });
  };
  return {
    take(request) {
      if ("run" in request) run = request.run;
      const transferred = request.kind === "open" && "bytes" in request.source ? [request.source.bytes] : [];
      worker.postMessage(request, transferred); // on "close" the worker terminates itself
    },
  };
}
