/** The frames of a stream for programs in Node or on a page, without a worker or canvas. */

import type { FramePacket, StreamSource } from "../protocol.js";
import { StreamError } from "../stream-error.js";
import { Decoding } from "./decoding.js";
import { generateFrames, type FramesOptions } from "./frames.js";

export type * from "../protocol.js";
export { Splats } from "../splats.js";
export { StreamError, type FramesOptions };

/**
 * The frames of a stream in order, each as the changes to the previous one; the first is complete. The next frame is
 * decoded on demand.
 *
 * Throws StreamError, after returning all frames before the error.
 */
export function readFrames(
  source: StreamSource,
  options: FramesOptions = {},
): AsyncGenerator<FramePacket, void, void> {
  return generateFrames((receive) => new Decoding(receive), source, options, 0);
}
