/** A stream, from its first byte to its last: the state of every frame (SPEC 5.1, 7, 9.2). */

import { ChunkReader, HEAD_PLACE, readMagic } from "./chunks.js";
import type { Chunk, Place } from "./chunks.js";
import { HEAD_BYTES_LIMIT } from "./constants.js";
import { parseHeader } from "./header.js";
import type { StreamHeader } from "./header.js";
import type { Source } from "./source.js";
import type { State } from "./state.js";
import { StateDecoder } from "./states.js";

/** A frame that is given out. */
export interface Frame {
  readonly header: StreamHeader;
  readonly state: State;
}

/**
 * The frames of a stream, each once the CRC of its state holds.
 *
 * @throws Rejection where the stream does not conform; the frames before have been given
 * @throws Declined where a stream of the unlimited level is too large for this decoder
 */
export function* decodeStream(source: Source): Generator<Frame, void, undefined> {
  const { header, reader } = openStream(source);
  yield* decodeChunks(header, reader, new StateDecoder(header));
}

/** The frames of all chunks from one on. */
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

/** What HEAD says, and the chunks that follow it. */
export function openStream(source: Source): { readonly header: StreamHeader; readonly reader: ChunkReader } {
  readMagic(source);
  const head = new ChunkReader(source, HEAD_PLACE, HEAD_BYTES_LIMIT, false);
  const header = parseHeader(head.next().payload);
  return { header, reader: readerAt(source, head.place, header) };
}

/** The chunks from `place` on, where `source` is. */
export function readerAt(source: Source, place: Place, header: StreamHeader): ChunkReader {
  return new ChunkReader(source, place, header.limits.payloadBytes, header.snapshots);
}
