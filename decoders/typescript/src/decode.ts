/** Decodes a whole stream to the states of its frames (SPEC 5.1, 7, 9.2). */

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
 * Generate the frames of a stream; the state CRC of a frame is checked before the frame is returned.
 *
 * @throws Rejection if the stream is invalid, after the valid frames before the error have been returned
 * @throws Declined if a stream at the unlimited level exceeds the limits of this decoder
 */
export function* decodeStream(source: Source): Generator<Frame, void, undefined> {
  const { header, reader } = openStream(source);
  yield* decodeChunks(header, reader, new StateDecoder(header));
}

/** Generate the frames of all chunks from the reader's position onwards. */
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

/** Read HEAD; return the header, and a reader of the following chunks. */
export function openStream(source: Source): { readonly header: StreamHeader; readonly reader: ChunkReader } {
  readMagic(source);
  const headReader = new ChunkReader(source, HEAD_PLACE, HEAD_BYTES_LIMIT, false);
  const header = parseHeader(headReader.next().payload);
  return { header, reader: makeReader(source, headReader.place, header) };
}

/** Make a reader of the chunks from `place` onwards; `source` must be at the offset of `place`. */
export function makeReader(source: Source, place: Place, header: StreamHeader): ChunkReader {
  return new ChunkReader(source, place, header.limits.payloadBytes, header.hasSnapshots);
}
