/** Entry point of the decoder for programs in Node or on a page, without a worker or canvas. */

import type { FramePacket, StreamSource } from "../protocol.js";
import { StreamError } from "../stream-error.js";
import { DecodeService } from "./decode-service.js";
import { generateFrames, type FramesOptions } from "./frames.js";

export type * from "../protocol.js";
export { Splats } from "../splats.js";
export { StreamError, type FramesOptions };

/**
 * Generate the packets of a stream in order of frames. Each packet contains the changes from the previous frame; the
 * first packet contains all Gaussians. A frame is decoded when it is requested.
 *
 * Throws StreamError after the last frame before the error, and the reason of `signal` after it is aborted.
 */
export function readFrames(
  source: StreamSource,
  options: FramesOptions = {},
): AsyncGenerator<FramePacket, void, void> {
  return generateFrames((receive) => new DecodeService(receive), source, options, 0);
}
