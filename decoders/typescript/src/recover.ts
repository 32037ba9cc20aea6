/** A stream past its damage: the frames that can be had, and the gaps between them (SPEC 11.4, 11.5). */

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

/** A part of the stream that is left out. */
export interface Gap {
  readonly offset: number;
  readonly bytes: number;
  readonly rejectId: RejectId;
  /** The frames that are missing for it, null where this cannot be told. */
  readonly framesLost: number | null;
}

export type Recovered = { readonly frame: Frame } | { readonly gap: Gap };

/**
 * The frames and the gaps of a stream, in its order: no frame whose CRC does not hold or whose ordinal is not above
 * those before (11.4-1), and every gap (11.4-2).
 *
 * @throws Rejection where HEAD is rejected, or a critical chunk is of an unknown type (SPEC 3.3)
 * @throws Declined where a stream of the unlimited level is too large for this decoder
 */
export function* recoverStream(bytes: Uint8Array): Generator<Recovered, void, undefined> {
  const { header, reader } = openStream(new MemorySource(bytes));
  yield* new Recovery(bytes, header, reader).parts();
}

/** What became of a chunk: the state that it makes, if any, or why it is rejected. */
type Trial = { readonly rejectId: null; readonly chunk: Chunk; readonly state: State | null } | RejectedTrial;

interface RejectedTrial {
  readonly rejectId: RejectId;
  /** The header, if it is accepted. */
  readonly header: ChunkHeader | null;
}

/**
 * The loop of 11.4. Of its variables `place` and `number` are the reader's, `due` and `whole` the decoder's, and
 * `spent` is the search's.
 */
class Recovery {
  readonly #bytes: Uint8Array;
  readonly #header: StreamHeader;
  readonly #decoder: StateDecoder;
  readonly #search: ChunkSearch;
  #reader: ChunkReader;
  /** The ordinal of the first frame of the stream, null where it is not known. */
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

  /** Read the chunk that is due and decode it; the reader is behind it then only if the CRC of its payload holds. */
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

  /** Leave out an ancillary chunk alone. */
  #leaveOut({ offset, sequence }: Place, { rejectId, header }: LoneTrial): Recovered {
    const end = offset + chunkBytes(header);
    this.#goTo({ offset: end, sequence: sequence + 1 });
    return gap(offset, end, rejectId, 0);
  }

  /** Go on at the next chunk that allows it; return whether there is one. */
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

  /** The bytes behind TAIL. */
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

/** Whether a chunk is ancillary, and whole, so that decoding goes on right behind it. */
function isLeftOutAlone(trial: RejectedTrial): trial is LoneTrial {
  return trial.header !== null && isAncillary(trial.header.type) && trial.rejectId !== "truncated";
}

/** The ordinal that is due where decoding goes on; at TAIL that of the frame behind the last, if it can be told. */
function ordinalDue(found: Resumption, first: number | null): number | null {
  if (found.type !== "TAIL") return found.frame;
  return first === null ? null : first + found.frameCount;
}

/** How many frames are missing where `before` was due and `due` is now; null where this cannot be told. */
function countLost(before: number | null, due: number | null): number | null {
  return before === null || due === null || due < before ? null : due - before;
}

function gap(offset: number, end: number, rejectId: RejectId, framesLost: number | null): Recovered {
  return { gap: { offset, bytes: end - offset, rejectId, framesLost } };
}
