/** Search for the next chunk at which decoding can resume after damage (SPEC 11.4, `resume`). */

import { chunkBytes, headerCrcHolds, parseChunkHeader, SYNC_WORD } from "./chunks.js";
import type { ChunkHeader, Place } from "./chunks.js";
import { CHUNK_CRC_BYTES, CHUNK_HEADER_BYTES, LEVELS, TAIL_BYTES, UNLIMITED_LEVEL } from "./constants.js";
import { crc32 } from "./crc.js";
import { Fields } from "./fields.js";
import type { StreamHeader } from "./header.js";
import { parseTail } from "./tail.js";

/** The bytes of the ordinal at the start of a CANO, and of the two ordinals at the start of a SNAP. */
const CANONICAL_HEAD_BYTES = 4;
const SNAPSHOT_HEAD_BYTES = 8;

/** The level whose limit measures the effort for the unlimited level. */
const EFFORT_LEVEL = 30;

/** Payloads may be checked in vain for this multiple of the bytes up to a chunk, plus one payload. */
const EFFORT = 16;

/**
 * A chunk at which decoding can resume: a CANO or SNAP with the ordinal of its frame, or a TAIL with its frame count.
 */
export type Resumption =
  | { readonly place: Place; readonly type: "CANO" | "SNAP"; readonly frame: number }
  | { readonly place: Place; readonly type: "TAIL"; readonly frameCount: number };

/** All searches in one stream, which share a limit of effort (13-2). */
export class ChunkSearch {
  readonly #bytes: Buffer;
  readonly #payloadLimit: number;
  readonly #effortBound: number;
  #spent = 0;

  constructor(bytes: Uint8Array, { level, limits }: StreamHeader) {
    this.#bytes = Buffer.from(bytes.buffer, bytes.byteOffset, bytes.length);
    this.#payloadLimit = limits.payloadBytes;
    const effortLimits = LEVELS.get(level === UNLIMITED_LEVEL ? EFFORT_LEVEL : level);
    this.#effortBound = (effortLimits ?? limits).payloadBytes;
  }

  /** Count a payload that was checked in vain. */
  spend(length: number): void {
    this.#spent += length;
  }

  /**
   * The first chunk from `from` on at which decoding can resume, or null if there is none.
   *
   * @param due as in 11.4
   * @param canonical the ordinal of the last decoded CANO; null if there is none, or in streams without snapshots
   */
  find(from: Place, due: number | null, canonical: number | null): Resumption | null {
    for (let at = this.#nextSync(from.offset); at >= 0; at = this.#nextSync(at + 1)) {
      const header = this.#readHeader(at);
      if (header === null || header.sequence < from.sequence || !this.#isCandidate(header, canonical)) continue;
      if (this.#spent > EFFORT * (at + this.#effortBound)) continue;
      const found = this.#prove(at, header, due, canonical);
      if (found !== null) return found;
      this.spend(header.length);
    }
    return null;
  }

  /** The position of the next sync word from `offset` on; -1 if there is none. */
  #nextSync(offset: number): number {
    return this.#bytes.indexOf(SYNC_WORD, offset);
  }

  #readHeader(at: number): ChunkHeader | null {
    const bytes = this.#bytes.subarray(at, at + CHUNK_HEADER_BYTES);
    return bytes.length === CHUNK_HEADER_BYTES && headerCrcHolds(bytes) ? parseChunkHeader(bytes) : null;
  }

  #isCandidate({ type, length }: ChunkHeader, canonical: number | null): boolean {
    if (length > this.#payloadLimit) return false;
    if (type === "CANO") return length >= CANONICAL_HEAD_BYTES;
    if (type === "SNAP") return length >= SNAPSHOT_HEAD_BYTES && canonical !== null;
    return type === "TAIL" && length === TAIL_BYTES;
  }

  /** The chunk at `at`, if its payload is intact and decoding can resume at it. */
  #prove(at: number, header: ChunkHeader, due: number | null, canonical: number | null): Resumption | null {
    const end = at + chunkBytes(header);
    if (end > this.#bytes.length) return null;
    const payload = this.#bytes.subarray(at + CHUNK_HEADER_BYTES, end - CHUNK_CRC_BYTES);
    if (crc32(payload) !== this.#bytes.readUInt32LE(end - CHUNK_CRC_BYTES)) return null;
    const place = { offset: at, sequence: header.sequence };
    if (header.type === "CANO" || header.type === "SNAP") {
      const fields = new Fields(payload);
      const frame = fields.u32("frame");
      if (header.type === "SNAP" && fields.u32("canonical") !== canonical) return null;
      return due === null || frame >= due ? { place, type: header.type, frame } : null;
    }
    const last = end === this.#bytes.length;
    return last ? { place, type: "TAIL", frameCount: parseTail(payload).frameCount } : null;
  }
}
