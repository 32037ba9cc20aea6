/** A stream, from its first byte to its last: the state of every frame (SPEC 5.1, 7, 9.2). */

import { checkCameras, checkMetadata } from "./ancillary.js";
import { parseCanonical } from "./canonical.js";
import { ChunkReader } from "./chunks.js";
import type { Chunk } from "./chunks.js";
import { stateCrc } from "./digest.js";
import { decodeFrame, parseFrame } from "./frame.js";
import { parseHeader } from "./header.js";
import type { StreamHeader } from "./header.js";
import { demand } from "./reject.js";
import type { Source } from "./source.js";
import { decodeCanonical } from "./state.js";
import type { State } from "./state.js";
import { StreamRecord } from "./tail.js";

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
  const reader = new ChunkReader(source);
  const chunks = reader.chunks();
  const header = parseHeader(firstPayload(chunks));
  reader.payloadLimit = header.limits.payloadBytes;
  const record = new StreamRecord();
  let state: State | null = null;
  for (const chunk of chunks) {
    const next = decodeChunk(chunk, state, header, record);
    if (next === null) continue;
    state = next;
    yield { header, state };
  }
}

/** The state that a chunk makes, or null of a chunk that makes none. */
function decodeChunk(chunk: Chunk, state: State | null, header: StreamHeader, record: StreamRecord): State | null {
  switch (chunk.type) {
    case "CANO":
      return proveCanonical(chunk, state, header, record);
    case "FRAM":
      return proveFrame(chunk, state, header, record);
    case "INDX":
      record.checkIndex(chunk);
      return null;
    case "TAIL":
      record.checkTail(chunk);
      return null;
    case "came":
      checkCameras(chunk.payload);
      return null;
    case "meta":
      checkMetadata(chunk.payload);
      return null;
    default:
      // An ancillary chunk of a type that is not known: its CRCs and its length were checked.
      return null;
  }
}

function proveCanonical(chunk: Chunk, before: State | null, header: StreamHeader, record: StreamRecord): State {
  const canonical = parseCanonical(chunk.payload);
  const state = prove(decodeCanonical(canonical, before, header), canonical.stateCrc, header);
  record.addCanonical(chunk, state.ordinal);
  return state;
}

function proveFrame(chunk: Chunk, before: State | null, header: StreamHeader, record: StreamRecord): State {
  demand(before !== null, "chunk-order", "FRAM comes before the first CANO");
  const frame = parseFrame(chunk.payload);
  const state = prove(decodeFrame(frame, before, header), frame.stateCrc, header);
  record.addFrame();
  return state;
}

/** A state, once it is held against the CRC of its chunk. */
function prove(state: State, crc: number, header: StreamHeader): State {
  const found = stateCrc(state.scene, state.phase, state.phase % header.fullCrcInterval === 0);
  demand(found === crc, "state-crc", `the state of frame ${state.ordinal} does not match its CRC`);
  return state;
}

function firstPayload(chunks: Iterator<Chunk, void>): Uint8Array {
  const first = chunks.next();
  demand(first.done !== true, "truncated", "the stream ends before HEAD does");
  return first.value.payload;
}
