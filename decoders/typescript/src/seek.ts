/** Random access: frames from a given one on, without decoding what precedes its seek point (SPEC 11.2). */

import { CHUNK_CRC_BYTES, CHUNK_HEADER_BYTES, TAIL_BYTES } from "./constants.js";
import { chunkBytes, headerCrcHolds, isSynced, parseChunkHeader } from "./chunks.js";
import type { Chunk, ChunkReader, Place } from "./chunks.js";
import { crc32 } from "./crc.js";
import { decodeChunks, openStream, readerAt } from "./decode.js";
import type { Frame } from "./decode.js";
import { Fields } from "./fields.js";
import type { StreamHeader } from "./header.js";
import { demand, Rejection } from "./reject.js";
import { parseOrdinals } from "./snapshots.js";
import { MemorySource } from "./source.js";
import { StateDecoder } from "./states.js";
import { parseIndex, parseTail } from "./tail.js";
import type { SeekPoint } from "./tail.js";

/** The bytes of the ordinal at the start of a CANO or SNAP. */
const ORDINAL_BYTES = 4;

/** The canonical frames up to a seek point, which is the last of them, and the number of frames before it. */
interface Route {
  readonly points: readonly SeekPoint[];
  readonly frameCount: number;
}

/**
 * The frames from ordinal `start` on.
 *
 * @throws Rejection if HEAD, INDX or a chunk from the seek point on does not conform
 * @throws Declined if a stream of the unlimited level exceeds the limits of this decoder
 */
export function* seekStream(bytes: Uint8Array, start: number): Generator<Frame, void, undefined> {
  const { header, reader } = openStream(new MemorySource(bytes));
  const first = reader.place;
  const route = routeByIndex(bytes, header, start) ?? routeByHeaders(reader, start);
  const frames = route.points.length === 0 ? decodeFrom(bytes, header, first) : decodeRoute(bytes, header, route);
  for (const frame of frames) if (frame.state.ordinal >= start) yield frame;
}

/** The frames of a stream from its seek point on. */
function* decodeRoute(bytes: Uint8Array, header: StreamHeader, { points, frameCount }: Route): Generator<Frame> {
  const before = points.slice(0, -1);
  const point = points[before.length];
  const chunk = readPoint(bytes, header, point, ["CANO", "SNAP"]);
  const decoder = new StateDecoder(header);
  if (chunk.type === "SNAP") {
    const { canonical } = parseOrdinals(new Fields(chunk.payload));
    const base = points.filter(({ frame }) => frame === canonical).at(-1);
    demand(base !== undefined, "index-mismatch", `a snapshot refers to frame ${canonical}, which has no seek point`);
    decodePoint(decoder, readPoint(bytes, header, base, ["CANO"]), base);
  }
  decoder.seek(frameCount, before);
  yield { header, state: decodePoint(decoder, chunk, point) };
  const end = chunk.offset + chunkBytes({ ...chunk, length: chunk.payload.length });
  yield* decodeFrom(bytes, header, { offset: end, sequence: chunk.sequence + 1 }, decoder);
}

function decodeFrom(
  bytes: Uint8Array,
  header: StreamHeader,
  place: Place,
  decoder = new StateDecoder(header),
): Generator<Frame> {
  return decodeChunks(header, readerAt(new MemorySource(bytes, place.offset), place, header), decoder);
}

/** The state of the chunk at a seek point, whose ordinal must match. */
function decodePoint(decoder: StateDecoder, chunk: Chunk, { frame }: SeekPoint) {
  const state = decoder.decode(chunk);
  demand(state?.ordinal === frame, "index-mismatch", `the seek point of frame ${frame} leads to another frame`);
  return state;
}

/** Step 1: by INDX; null if there is none. */
function routeByIndex(bytes: Uint8Array, header: StreamHeader, start: number): Route | null {
  const found = readTail(bytes);
  if (found === null || found.tail.indexOffset === 0n) return null;
  const { tail, place } = found;
  const offset = numberOf(tail.indexOffset);
  const index = readPointed(bytes, header, { offset, sequence: place.sequence - 1 }, ["INDX"], place.offset);
  const points = parseIndex(index.payload);
  const message = "INDX does not have as many seek points as TAIL says";
  demand(points.length === tail.canonicalCount, "index-mismatch", message);
  while (points.length > 0 && points[points.length - 1].frame > start) points.pop();
  const frameCount = points.length === 0 ? 0 : points[points.length - 1].frame - points[0].frame;
  return { points, frameCount };
}

/** Step 2: from chunk header to chunk header, up to the first error, which decoding will find again. */
function routeByHeaders(reader: ChunkReader, start: number): Route {
  const points: SeekPoint[] = [];
  let frameCount = 0;
  let framesBefore = 0;
  let due: number | null = null;
  for (const chunk of passOverAll(reader)) {
    if (!["CANO", "SNAP", "FRAM"].includes(chunk.type)) continue;
    const frame = ordinalOf(chunk, due);
    if (frame === null || frame > start) break;
    if (chunk.type !== "FRAM") {
      points.push({ offset: BigInt(chunk.offset), sequence: chunk.sequence, frame });
      framesBefore = frameCount;
    }
    frameCount += 1;
    due = frame + 1;
  }
  return { points, frameCount: framesBefore };
}

/** The ordinal of a chunk's frame, where `due` is expected; null if the chunk has none. */
function ordinalOf({ type, payload }: Chunk, due: number | null): number | null {
  if (type === "FRAM" || (type === "SNAP" && due === null)) return due;
  return payload.length < ORDINAL_BYTES ? null : new Fields(payload).u32("frame");
}

/** The chunks up to TAIL, the end of the stream, or a rejected header; payloads are not checked. */
function* passOverAll(reader: ChunkReader): Generator<Chunk> {
  try {
    let type = "";
    while (type !== "TAIL") {
      const chunk = reader.passOver(reader.readHeader());
      yield chunk;
      type = chunk.type;
    }
  } catch (error) {
    if (!(error instanceof Rejection)) throw error;
  }
}

/** TAIL and its position, if it ends the stream and its CRCs are correct. */
function readTail(bytes: Uint8Array) {
  const offset = bytes.length - CHUNK_HEADER_BYTES - TAIL_BYTES - CHUNK_CRC_BYTES;
  const head = bytes.subarray(offset, offset + CHUNK_HEADER_BYTES);
  if (!isSynced(head) || !headerCrcHolds(head)) return null;
  const { type, sequence, length } = parseChunkHeader(head);
  if (type !== "TAIL" || length !== TAIL_BYTES) return null;
  const payload = bytes.subarray(offset + CHUNK_HEADER_BYTES, -CHUNK_CRC_BYTES);
  if (crc32(payload) !== new Fields(bytes.subarray(-CHUNK_CRC_BYTES)).u32("payload_crc")) return null;
  return { tail: parseTail(payload), place: { offset, sequence } };
}

function readPoint(bytes: Uint8Array, header: StreamHeader, point: SeekPoint, types: readonly string[]): Chunk {
  return readPointed(bytes, header, { offset: numberOf(point.offset), sequence: point.sequence }, types);
}

/** The chunk at an offset, which must have one of `types` and, if `end` is given, end there. */
function readPointed(
  bytes: Uint8Array,
  header: StreamHeader,
  place: Place,
  types: readonly string[],
  end: number | null = null,
): Chunk {
  const reader = readerAt(new MemorySource(bytes, place.offset), place, header);
  const head = followed(() => reader.readHeader());
  const fits = types.includes(head.type) && (end === null || place.offset + chunkBytes(head) === end);
  demand(fits, "index-mismatch", `an offset leads to another chunk than ${types.join(" or ")}`);
  return reader.readPayload(head);
}

/** Read at an offset; any error is an error of the offset. */
function followed<Result>(read: () => Result): Result {
  try {
    return read();
  } catch (error) {
    if (!(error instanceof Rejection)) throw error;
    throw new Rejection("index-mismatch", `an offset leads to no chunk header: ${error.message}`);
  }
}

/** An offset. Offsets above 2^53 are beyond every stream, even when rounded to the nearest double. */
function numberOf(offset: bigint): number {
  return Number(offset);
}
