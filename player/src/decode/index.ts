/** The frames of a stream for programs, in Node or on a page, without a worker or a picture. */

import type { FramePacket, StreamSource } from "../protocol.js";
import { StreamError } from "../stream-error.js";
import { Decoding } from "./decoding.js";
import { generateFrames, type FramesOptions } from "./frames.js";

export type * from "../protocol.js";
export { Splats } from "../splats.js";
export { StreamError, type FramesOptions };

/**
 * The frames of a stream in order, each as the changes to the one before; the first is full. The
 * next frame is decoded when it is asked for.
 *
 * Throws StreamError, after all frames before the fault.
 */
export function readFrames(
  source: StreamSource,
  options: FramesOptions = {},
): AsyncGenerator<FramePacket, void, void> {
  return generateFrames((receive) => new Decoding(receive), source, options, 0);
}
