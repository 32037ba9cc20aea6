/** Decoding of a whole stream: the state of every frame (SPEC 5.1, 7, 9.2). */

import { ChunkReader, HEAD_PLACE, readMagic } from "./chunks.js";
import type { Chunk, Place } from "./chunks.js";
import { HEAD_BYTES_LIMIT } from "./constants.js";
import { parseHeader } from "./header.js";
import type { StreamHeader } from "./header.js";
import type { Source } from "./source.js";
import type { State } from "./state.js";
import { StateDecoder } from "./states.js";

/** A decoded frame. */
export interface Frame {
  readonly header: StreamHeader;
  readonly state: State;
}

/**
 * The frames of a stream, each after its state CRC has been checked.
 *
 * @throws Rejection if the stream does not conform; all frames before have been returned
 * @throws Declined if a stream of the unlimited level exceeds the limits of this decoder
 */
export function* decodeStream(source: Source): Generator<Frame, void, undefined> {
  const { header, reader } = openStream(source);
  yield* decodeChunks(header, reader, new StateDecoder(header));
}

/** The frames of all chunks from the reader's position on. */
export function* decodeChunks(
  header: StreamHeader,
  reader: ChunkReader,
  decoder: StateDecoder,
): Generator<Frame, void, undefined> {
  let chunk: Chunk;
  do {
    chunk = reader.next();
    const state = decoder.decode(chunk);
    if (state !== null) yield { header, state };
  } while (chunk.type !== "TAIL");
  reader.finish();
}

/** Read HEAD, and return it with a reader of the following chunks. */
export function openStream(source: Source): { readonly header: StreamHeader; readonly reader: ChunkReader } {
  readMagic(source);
  const head = new ChunkReader(source, HEAD_PLACE, HEAD_BYTES_LIMIT, false);
  const header = parseHeader(head.next().payload);
  return { header, reader: readerAt(source, head.place, header) };
}

/** A reader of the chunks from `place` on, which is the position of `source`. */
export function readerAt(source: Source, place: Place, header: StreamHeader): ChunkReader {
  return new ChunkReader(source, place, header.limits.payloadBytes, header.snapshots);
}
