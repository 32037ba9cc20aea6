/** Recovery of a damaged stream: its intact frames, and the gaps between them (SPEC 11.4, 11.5). */

import { chunkBytes, isAncillary } from "./chunks.js";
import type { Chunk, ChunkHeader, ChunkReader, Place } from "./chunks.js";
import { openStream, readerAt } from "./decode.js";
import type { Frame } from "./decode.js";
import type { StreamHeader } from "./header.js";
import { Rejection } from "./reject.js";
import type { RejectId } from "./reject.js";
import { ChunkSearch } from "./search.js";
import type { Resumption } from "./search.js";
import { MemorySource } from "./source.js";
import type { State } from "./state.js";
import { StateDecoder } from "./states.js";

/** A part of the stream that was skipped. */
export interface Gap {
  readonly offset: number;
  readonly bytes: number;
  readonly rejectId: RejectId;
  /** The number of lost frames, or null if unknown. */
  readonly framesLost: number | null;
}

export type Recovered = { readonly frame: Frame } | { readonly gap: Gap };

/**
 * The frames and gaps of a stream, in order: only frames with a correct CRC and with ordinals above those before
 * (11.4-1), and all gaps (11.4-2).
 *
 * @throws Rejection if HEAD is rejected, or a critical chunk has an unknown type (SPEC 3.3)
 * @throws Declined if a stream of the unlimited level exceeds the limits of this decoder
 */
export function* recoverStream(bytes: Uint8Array): Generator<Recovered, void, undefined> {
  const { header, reader } = openStream(new MemorySource(bytes));
  yield* new Recovery(bytes, header, reader).parts();
}

/** The result of a chunk: its state, if it has one, or why it is rejected. */
type Trial = { readonly rejectId: null; readonly chunk: Chunk; readonly state: State | null } | RejectedTrial;

interface RejectedTrial {
  readonly rejectId: RejectId;
  /** The header, if it was accepted. */
  readonly header: ChunkHeader | null;
}

/**
 * The loop of 11.4. Of its variables, `place` and `number` are in the reader, `due` and `whole` in the decoder, and
 * `spent` is in the search.
 */
class Recovery {
  readonly #bytes: Uint8Array;
  readonly #header: StreamHeader;
  readonly #decoder: StateDecoder;
  readonly #search: ChunkSearch;
  #reader: ChunkReader;
  /** The ordinal of the first frame of the stream, or null if unknown. */
  #first: number | null = null;

  constructor(bytes: Uint8Array, header: StreamHeader, reader: ChunkReader) {
    this.#bytes = bytes;
    this.#header = header;
    this.#decoder = new StateDecoder(header);
    this.#search = new ChunkSearch(bytes, header);
    this.#reader = reader;
  }

  *parts(): Generator<Recovered, void, undefined> {
    let goesOn = true;
    while (goesOn) {
      const begin = this.#reader.place;
      const trial = this.#tryChunk();
      if (trial.rejectId === null) {
        if (trial.state !== null) yield { frame: { header: this.#header, state: trial.state } };
        goesOn = trial.chunk.type !== "TAIL";
        if (!goesOn) yield* this.#rest();
      } else if (isLeftOutAlone(trial)) {
        yield this.#leaveOut(begin, trial);
      } else {
        if (trial.rejectId === "payload-crc") this.#search.spend(trial.header?.length ?? 0);
        goesOn = yield* this.#resume(begin, trial.rejectId);
      }
    }
  }

  /** Read and decode the next chunk; the reader advances only if the payload CRC is correct. */
  #tryChunk(): Trial {
    const due = this.#decoder.due;
    let header: ChunkHeader | null = null;
    try {
      header = this.#reader.readHeader();
      const chunk = this.#reader.readPayload(header);
      const state = this.#decoder.decode(chunk);
      if (state !== null && due === null) this.#first = state.ordinal;
      return { rejectId: null, chunk, state };
    } catch (error) {
      if (!(error instanceof Rejection) || error.rejectId === "unknown-critical") throw error;
      return { rejectId: error.rejectId, header };
    }
  }

  /** Skip a single ancillary chunk. */
  #leaveOut({ offset, sequence }: Place, { rejectId, header }: LoneTrial): Recovered {
    const end = offset + chunkBytes(header);
    this.#goTo({ offset: end, sequence: sequence + 1 });
    return gap(offset, end, rejectId, 0);
  }

  /** Continue at the next suitable chunk; returns whether there is one. */
  *#resume({ offset }: Place, rejectId: RejectId): Generator<Recovered, boolean, undefined> {
    const before = this.#decoder.due;
    const found = this.#search.find(this.#reader.place, before, this.#decoder.canonical);
    if (found === null) {
      const end = this.#bytes.length;
      yield gap(offset, end, rejectId, null);
      if (rejectId !== "truncated") yield gap(end, end, "truncated", null);
      return false;
    }
    const due = ordinalDue(found, this.#first);
    this.#decoder.resume(due);
    this.#goTo(found.place);
    yield gap(offset, found.place.offset, rejectId, countLost(before, due));
    return true;
  }

  /** Handle the bytes after TAIL. */
  *#rest(): Generator<Recovered, void, undefined> {
    const { offset } = this.#reader.place;
    if (offset < this.#bytes.length) yield gap(offset, this.#bytes.length, "trailing-data", null);
  }

  #goTo(place: Place): void {
    const source = new MemorySource(this.#bytes, place.offset);
    this.#reader = readerAt(source, place, this.#header);
  }
}

type LoneTrial = RejectedTrial & { readonly header: ChunkHeader };

/** Whether a chunk is ancillary and intact, so that decoding can continue right after it. */
function isLeftOutAlone(trial: RejectedTrial): trial is LoneTrial {
  return trial.header !== null && isAncillary(trial.header.type) && trial.rejectId !== "truncated";
}

/** The ordinal expected where decoding continues; at TAIL, that after the last frame, if known. */
function ordinalDue(found: Resumption, first: number | null): number | null {
  if (found.type !== "TAIL") return found.frame;
  return first === null ? null : first + found.frameCount;
}

/** The number of frames between the expected ordinals `before` and `due`, or null if unknown. */
function countLost(before: number | null, due: number | null): number | null {
  return before === null || due === null || due < before ? null : due - before;
}

function gap(offset: number, end: number, rejectId: RejectId, framesLost: number | null): Recovered {
  return { gap: { offset, bytes: end - offset, rejectId, framesLost } };
}
