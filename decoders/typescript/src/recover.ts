/** Recovers the intact frames of a damaged stream, and reports the gaps between them (SPEC 11.4, 11.5). */

import { chunkLength, isAncillary } from "./chunks.js";
import type { Chunk, ChunkHeader, ChunkReader, Place } from "./chunks.js";
import { openStream, makeReader } from "./decode.js";
import type { Frame } from "./decode.js";
import type { StreamHeader } from "./header.js";
import { Rejection } from "./reject.js";
import type { RejectId } from "./reject.js";
import { ChunkSearch } from "./search.js";
import type { Resumption } from "./search.js";
import { MemorySource } from "./source.js";
import type { State } from "./state.js";
import { StateDecoder } from "./states.js";

/** A skipped part of the stream. */
export interface Gap {
  readonly offset: number;
  readonly bytes: number;
  readonly rejectId: RejectId;
  /** The number of lost frames, or null if unknown. */
  readonly framesLost: number | null;
}

export type RecoveredPart = { readonly frame: Frame } | { readonly gap: Gap };

/**
 * Generate the frames and gaps of a stream, in order. Frames have a correct CRC and increasing ordinals (11.4-1); no gap
 * is left out (11.4-2).
 *
 * @throws Rejection if HEAD is rejected, or a critical chunk has an unknown type (SPEC 3.3)
 * @throws Declined if a stream at the unlimited level exceeds the limits of this decoder
 */
export function* recoverStream(bytes: Uint8Array): Generator<RecoveredPart, void, undefined> {
  const { header, reader } = openStream(new MemorySource(bytes));
  yield* new Recovery(bytes, header, reader).recoverParts();
}

/** The result of trying to decode a chunk: its state (null if it has no state), or its reject id. */
type Trial = { readonly rejectId: null; readonly chunk: Chunk; readonly state: State | null } | RejectedTrial;

interface RejectedTrial {
  readonly rejectId: RejectId;
  /** The chunk header; null if the header was rejected. */
  readonly header: ChunkHeader | null;
}

/**
 * Implements the loop of 11.4. The reader holds its variables `place` and `number`; the decoder holds `due` and `whole`;
 * the search holds `spent`.
 */
class Recovery {
  readonly #bytes: Uint8Array;
  readonly #header: StreamHeader;
  readonly #decoder: StateDecoder;
  readonly #search: ChunkSearch;
  #reader: ChunkReader;
  /** The ordinal of the first frame of the stream, or null if unknown. */
  #firstOrdinal: number | null = null;

  constructor(bytes: Uint8Array, header: StreamHeader, reader: ChunkReader) {
    this.#bytes = bytes;
    this.#header = header;
    this.#decoder = new StateDecoder(header);
    this.#search = new ChunkSearch(bytes, header);
    this.#reader = reader;
  }

  *recoverParts(): Generator<RecoveredPart, void, undefined> {
    let canContinue = true;
    while (canContinue) {
      const start = this.#reader.place;
      const trial = this.#tryChunk();
      if (trial.rejectId === null) {
        if (trial.state !== null) yield { frame: { header: this.#header, state: trial.state } };
        canContinue = trial.chunk.type !== "TAIL";
        if (!canContinue) yield* this.#reportTrailingData();
      } else if (canSkipAlone(trial)) {
        yield this.#skipChunk(start, trial);
      } else {
        if (trial.rejectId === "payload-crc") this.#search.countWaste(trial.header?.length ?? 0);
        canContinue = yield* this.#resume(start, trial.rejectId);
      }
    }
  }

  /** Try to read and decode the next chunk; the reader advances only if the payload CRC is correct. */
  #tryChunk(): Trial {
    const due = this.#decoder.due;
    let header: ChunkHeader | null = null;
    try {
      header = this.#reader.readHeader();
      const chunk = this.#reader.readPayload(header);
      const state = this.#decoder.decode(chunk);
      if (state !== null && due === null) this.#firstOrdinal = state.ordinal;
      return { rejectId: null, chunk, state };
    } catch (error) {
      if (!(error instanceof Rejection) || error.rejectId === "unknown-critical") throw error;
      return { rejectId: error.rejectId, header };
    }
  }

  /** Skip a rejected ancillary chunk. */
  #skipChunk({ offset, sequence }: Place, { rejectId, header }: SkippableTrial): RecoveredPart {
    const end = offset + chunkLength(header);
    this.#moveTo({ offset: end, sequence: sequence + 1 });
    return makeGap(offset, end, rejectId, 0);
  }

  /** Continue at the next chunk at which decoding can resume; return whether there is such a chunk. */
  *#resume({ offset }: Place, rejectId: RejectId): Generator<RecoveredPart, boolean, undefined> {
    const dueBefore = this.#decoder.due;
    const resumption = this.#search.find(this.#reader.place, dueBefore, this.#decoder.canonical);
    if (resumption === null) {
      const end = this.#bytes.length;
      yield makeGap(offset, end, rejectId, null);
      if (rejectId !== "truncated") yield makeGap(end, end, "truncated", null);
      return false;
    }
    const due = findDueOrdinal(resumption, this.#firstOrdinal);
    this.#decoder.resume(due);
    this.#moveTo(resumption.place);
    yield makeGap(offset, resumption.place.offset, rejectId, countLostFrames(dueBefore, due));
    return true;
  }

  /** Report a gap if bytes follow TAIL. */
  *#reportTrailingData(): Generator<RecoveredPart, void, undefined> {
    const { offset } = this.#reader.place;
    if (offset < this.#bytes.length) yield makeGap(offset, this.#bytes.length, "trailing-data", null);
  }

  #moveTo(place: Place): void {
    const source = new MemorySource(this.#bytes, place.offset);
    this.#reader = makeReader(source, place, this.#header);
  }
}

type SkippableTrial = RejectedTrial & { readonly header: ChunkHeader };

/** Whether a rejected chunk is ancillary and its end is known, so that decoding can continue after it. */
function canSkipAlone(trial: RejectedTrial): trial is SkippableTrial {
  return trial.header !== null && isAncillary(trial.header.type) && trial.rejectId !== "truncated";
}

/** Return the expected ordinal where decoding continues; at TAIL, the ordinal after the last frame, null if unknown. */
function findDueOrdinal(resumption: Resumption, first: number | null): number | null {
  if (resumption.type !== "TAIL") return resumption.frame;
  return first === null ? null : first + resumption.frameCount;
}

/** Return the number of frames between two expected ordinals; null if unknown. */
function countLostFrames(dueBefore: number | null, due: number | null): number | null {
  return dueBefore === null || due === null || due < dueBefore ? null : due - dueBefore;
}

function makeGap(offset: number, end: number, rejectId: RejectId, framesLost: number | null): RecoveredPart {
  return { gap: { offset, bytes: end - offset, rejectId, framesLost } };
}
