/** Searches for the next chunk at which decoding can resume after damage (SPEC 11.4, `resume`). */

import { chunkLength, isHeaderCrcCorrect, parseChunkHeader, SYNC_WORD } from "./chunks.js";
import type { ChunkHeader, Place } from "./chunks.js";
import { CHUNK_CRC_BYTES, CHUNK_HEADER_BYTES, LEVELS, TAIL_BYTES, UNLIMITED_LEVEL } from "./constants.js";
import { crc32 } from "./crc.js";
import { Fields } from "./fields.js";
import type { StreamHeader } from "./header.js";
import { parseTail } from "./tail.js";

/** Size of the ordinal at the start of a CANO, and of the two ordinals at the start of a SNAP. */
const CANONICAL_HEAD_BYTES = 4;
const SNAPSHOT_HEAD_BYTES = 8;

/** The level whose payload limit bounds the effort for streams at the unlimited level. */
const EFFORT_LEVEL = 30;

/** Wasted checks are limited to this multiple of (bytes up to the chunk + payload limit) (13-2). */
const EFFORT_FACTOR = 16;

/**
 * A chunk at which decoding can resume: a CANO or SNAP with the ordinal of its frame, or a TAIL with its frame count.
 */
export type Resumption =
  | { readonly place: Place; readonly type: "CANO" | "SNAP"; readonly frame: number }
  | { readonly place: Place; readonly type: "TAIL"; readonly frameCount: number };

/** Searches in a stream; all searches share one limit of effort (13-2). */
export class ChunkSearch {
  readonly #bytes: Buffer;
  readonly #payloadLimit: number;
  readonly #effortBound: number;
  #spentBytes = 0;

  constructor(bytes: Uint8Array, { level, limits }: StreamHeader) {
    this.#bytes = Buffer.from(bytes.buffer, bytes.byteOffset, bytes.length);
    this.#payloadLimit = limits.payloadBytes;
    const effortLimits = LEVELS.get(level === UNLIMITED_LEVEL ? EFFORT_LEVEL : level);
    this.#effortBound = (effortLimits ?? limits).payloadBytes;
  }

  /** Count the bytes of a payload whose check was wasted. */
  countWaste(length: number): void {
    this.#spentBytes += length;
  }

  /**
   * Find the first chunk from `start` onwards at which decoding can resume; return null if there is no such chunk.
   *
   * @param due the expected ordinal of the next frame, null if unknown (11.4)
   * @param canonical the ordinal of the last decoded CANO; null if there is none, or in streams without snapshots
   */
  find(start: Place, due: number | null, canonical: number | null): Resumption | null {
    for (let offset = this.#nextSync(start.offset); offset >= 0; offset = this.#nextSync(offset + 1)) {
      const header = this.#readHeader(offset);
      if (header === null || header.sequence < start.sequence || !this.#isCandidate(header, canonical)) continue;
      if (this.#spentBytes > EFFORT_FACTOR * (offset + this.#effortBound)) continue;
      const resumption = this.#checkCandidate(offset, header, due, canonical);
      if (resumption !== null) return resumption;
      this.countWaste(header.length);
    }
    return null;
  }

  /** Return the offset of the next sync word from `offset` onwards; -1 if there is no sync word. */
  #nextSync(offset: number): number {
    return this.#bytes.indexOf(SYNC_WORD, offset);
  }

  #readHeader(offset: number): ChunkHeader | null {
    const bytes = this.#bytes.subarray(offset, offset + CHUNK_HEADER_BYTES);
    return bytes.length === CHUNK_HEADER_BYTES && isHeaderCrcCorrect(bytes) ? parseChunkHeader(bytes) : null;
  }

  #isCandidate({ type, length }: ChunkHeader, canonical: number | null): boolean {
    if (length > this.#payloadLimit) return false;
    if (type === "CANO") return length >= CANONICAL_HEAD_BYTES;
    if (type === "SNAP") return length >= SNAPSHOT_HEAD_BYTES && canonical !== null;
    return type === "TAIL" && length === TAIL_BYTES;
  }

  /** Return the chunk at `offset` if its payload is intact and decoding can resume at it; otherwise null. */
  #checkCandidate(
    offset: number,
    header: ChunkHeader,
    due: number | null,
    canonical: number | null,
  ): Resumption | null {
    const end = offset + chunkLength(header);
    if (end > this.#bytes.length) return null;
    const payload = this.#bytes.subarray(offset + CHUNK_HEADER_BYTES, end - CHUNK_CRC_BYTES);
    if (crc32(payload) !== this.#bytes.readUInt32LE(end - CHUNK_CRC_BYTES)) return null;
    const place = { offset, sequence: header.sequence };
    if (header.type === "CANO" || header.type === "SNAP") {
      const fields = new Fields(payload);
      const frame = fields.u32("frame");
      if (header.type === "SNAP" && fields.u32("canonical") !== canonical) return null;
      return due === null || frame >= due ? { place, type: header.type, frame } : null;
    }
    const isLast = end === this.#bytes.length;
    return isLast ? { place, type: "TAIL", frameCount: parseTail(payload).frameCount } : null;
  }
}
