/** Random access: decodes the frames from a given ordinal onwards, beginning at its seek point (SPEC 11.2). */

import { CHUNK_CRC_BYTES, CHUNK_HEADER_BYTES, TAIL_BYTES } from "./constants.js";
import { chunkLength, isHeaderCrcCorrect, hasSyncWord, parseChunkHeader } from "./chunks.js";
import type { Chunk, ChunkReader, Place } from "./chunks.js";
import { crc32 } from "./crc.js";
import { decodeChunks, openStream, makeReader } from "./decode.js";
import type { Frame } from "./decode.js";
import { Fields } from "./fields.js";
import type { StreamHeader } from "./header.js";
import { demand, Rejection } from "./reject.js";
import { parseOrdinals } from "./snapshots.js";
import { MemorySource } from "./source.js";
import { StateDecoder } from "./states.js";
import { parseIndex, parseTail } from "./tail.js";
import type { SeekPoint } from "./tail.js";

/**
 * Generate the frames from ordinal `start` onwards.
 *
 * @throws Rejection if HEAD, INDX, or a chunk at or after the seek point is invalid
 * @throws Declined if a stream at the unlimited level exceeds the limits of this decoder
 */
export function* seekStream(bytes: Uint8Array, start: number): Generator<Frame, void, undefined> {
  const { header, reader } = openStream(new MemorySource(bytes));
  const firstPlace = reader.place;
  const points = listPointsOfIndex(bytes, header, start) ?? listPointsOfHeaders(reader, start);
  const frames = points.length === 0 ? decodeFrom(bytes, header, firstPlace) : decodeFromLast(bytes, header, points);
  for (const frame of frames) if (frame.state.ordinal >= start) yield frame;
}

/** Generate the frames of a stream from the last of its first seek points onwards. */
function* decodeFromLast(bytes: Uint8Array, header: StreamHeader, points: readonly SeekPoint[]): Generator<Frame> {
  const earlierPoints = points.slice(0, -1);
  const point = points[earlierPoints.length];
  const chunk = readPoint(bytes, header, point, ["CANO", "SNAP"]);
  const decoder = new StateDecoder(header);
  if (chunk.type === "SNAP") {
    const { canonical } = parseOrdinals(new Fields(chunk.payload));
    const canonicalPoint = points.filter(({ frame }) => frame === canonical).at(-1);
    demand(
      canonicalPoint !== undefined,
      "index-mismatch",
      `a snapshot refers to frame ${canonical}, which has no seek point`,
    );
    decodePoint(decoder, readPoint(bytes, header, canonicalPoint, ["CANO"]), canonicalPoint);
  }
  decoder.seek(point.frame - points[0].frame, earlierPoints);
  yield { header, state: decodePoint(decoder, chunk, point) };
  const end = chunk.offset + chunkLength({ ...chunk, length: chunk.payload.length });
  yield* decodeFrom(bytes, header, { offset: end, sequence: chunk.sequence + 1 }, decoder);
}

function decodeFrom(
  bytes: Uint8Array,
  header: StreamHeader,
  place: Place,
  decoder = new StateDecoder(header),
): Generator<Frame> {
  return decodeChunks(header, makeReader(new MemorySource(bytes, place.offset), place, header), decoder);
}

/** Decode the chunk at a seek point, and check its ordinal. */
function decodePoint(decoder: StateDecoder, chunk: Chunk, { frame }: SeekPoint) {
  const state = decoder.decode(chunk);
  demand(state?.ordinal === frame, "index-mismatch", `the seek point of frame ${frame} leads to another frame`);
  return state;
}

/** Step 1 of 11.2: list the seek points up to a frame from INDX; return null if the stream has no INDX. */
function listPointsOfIndex(bytes: Uint8Array, header: StreamHeader, start: number): SeekPoint[] | null {
  const tailChunk = readTail(bytes);
  if (tailChunk === null || tailChunk.tail.indexOffset === 0n) return null;
  const { tail, place } = tailChunk;
  const offset = toNumber(tail.indexOffset);
  const index = readChunkAt(bytes, header, { offset, sequence: place.sequence - 1 }, ["INDX"], place.offset);
  const points = parseIndex(index.payload);
  const message = "INDX does not have as many seek points as TAIL says";
  demand(points.length === tail.canonicalCount, "index-mismatch", message);
  while (points.length > 0 && points[points.length - 1].frame > start) points.pop();
  return points;
}

/** Step 2 of 11.2: list the seek points up to a frame by reading chunk headers. */
function listPointsOfHeaders(reader: ChunkReader, start: number): SeekPoint[] {
  const points: SeekPoint[] = [];
  let due: number | null = null;
  for (const chunk of skipPayloads(reader)) {
    if (!["CANO", "SNAP", "FRAM"].includes(chunk.type)) continue;
    const frame = readOrdinal(chunk, due);
    if (frame > start) break;
    if (chunk.type !== "FRAM") points.push({ offset: BigInt(chunk.offset), sequence: chunk.sequence, frame });
    due = frame + 1;
    if (due > start) break; // a fault after the requested frame is found by decoding
  }
  return points;
}

/** Return the ordinal of a chunk's frame, where `due` is the expected ordinal; null before the first CANO. */
function readOrdinal({ type, payload }: Chunk, due: number | null): number {
  if (type === "CANO") return new Fields(payload).u32("frame");
  demand(due !== null, "chunk-order", `${type} comes before the first CANO`);
  return type === "FRAM" ? due : new Fields(payload).u32("frame");
}

/** Generate the chunks up to TAIL or to the end of the stream; payloads are not checked. */
function* skipPayloads(reader: ChunkReader): Generator<Chunk> {
  try {
    let type = "";
    while (type !== "TAIL") {
      const chunk = reader.skipPayload(reader.readHeader());
      yield chunk;
      type = chunk.type;
    }
    reader.finish();
  } catch (error) {
    if (!(error instanceof Rejection && error.rejectId === "truncated")) throw error;
  }
}

/** Read TAIL at the end of the stream; return null if it is missing or its CRCs are wrong. */
function readTail(bytes: Uint8Array) {
  const offset = bytes.length - CHUNK_HEADER_BYTES - TAIL_BYTES - CHUNK_CRC_BYTES;
  const headerBytes = bytes.subarray(offset, offset + CHUNK_HEADER_BYTES);
  if (!hasSyncWord(headerBytes) || !isHeaderCrcCorrect(headerBytes)) return null;
  const { type, sequence, length } = parseChunkHeader(headerBytes);
  if (type !== "TAIL" || length !== TAIL_BYTES) return null;
  const payload = bytes.subarray(offset + CHUNK_HEADER_BYTES, -CHUNK_CRC_BYTES);
  if (crc32(payload) !== new Fields(bytes.subarray(-CHUNK_CRC_BYTES)).u32("payload_crc")) return null;
  return { tail: parseTail(payload), place: { offset, sequence } };
}

function readPoint(bytes: Uint8Array, header: StreamHeader, point: SeekPoint, types: readonly string[]): Chunk {
  return readChunkAt(bytes, header, { offset: toNumber(point.offset), sequence: point.sequence }, types);
}

/** Read the chunk at `place`, which must have one of `types` and, if `end` is not null, end at `end`. */
function readChunkAt(
  bytes: Uint8Array,
  header: StreamHeader,
  place: Place,
  types: readonly string[],
  end: number | null = null,
): Chunk {
  const reader = makeReader(new MemorySource(bytes, place.offset), place, header);
  const chunkHeader = readFromIndex(() => reader.readHeader());
  const isExpected =
    types.includes(chunkHeader.type) && (end === null || place.offset + chunkLength(chunkHeader) === end);
  demand(isExpected, "index-mismatch", `an offset leads to another chunk than ${types.join(" or ")}`);
  return reader.readPayload(chunkHeader);
}

/** Read at an offset from the index; report any rejection as index-mismatch. */
function readFromIndex<Result>(readChunk: () => Result): Result {
  try {
    return readChunk();
  } catch (error) {
    if (!(error instanceof Rejection)) throw error;
    throw new Rejection("index-mismatch", `an offset leads to no chunk header: ${error.message}`);
  }
}

/** Convert an offset to a number. Offsets above 2^53 are rounded, but are beyond the end of every stream. */
function toNumber(offset: bigint): number {
  return Number(offset);
}
