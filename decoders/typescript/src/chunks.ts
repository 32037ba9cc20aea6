/**
 * Reads the chunks of a stream (SPEC 5.1, 5.2), and checks their framing, CRCs, types, sequence numbers and order. Of
 * payloads, only CRC and length are checked.
 */

import { CHUNK_CRC_BYTES, CHUNK_HEADER_BYTES, OWN_LIMITS } from "./constants.js";
import { crc32 } from "./crc.js";
import { Fields } from "./fields.js";
import { Declined, demand } from "./reject.js";
import type { Source } from "./source.js";

const MAGIC = Uint8Array.of(0x89, 0x51, 0x52, 0x43, 0x0d, 0x0a, 0x1a, 0x0a);
export const SYNC_WORD = Uint8Array.of(0x9e, 0x51, 0x43, 0xf3);
const KNOWN_CRITICAL_TYPES: ReadonlySet<string> = new Set(["HEAD", "CANO", "FRAM", "INDX", "TAIL"]);

/** The type of snapshots, which is known only in streams with FEATURE_SNAPSHOTS (5.10). */
const SNAPSHOT_TYPE = "SNAP";

/** The patterns of 5.2: letters 3 and 4 have the same case as letter 1; letter 2 may have either case. */
const TYPE_PATTERN = /^(?:[A-Z][A-Za-z][A-Z]{2}|[a-z][A-Za-z][a-z]{2})$/;

/** Position and sequence number of the next chunk. */
export interface Place {
  /** Bytes from the start of the stream. */
  readonly offset: number;
  readonly sequence: number;
}

/** The position of HEAD. */
export const HEAD_PLACE: Place = { offset: MAGIC.length, sequence: 0 };

export interface ChunkHeader {
  readonly type: string;
  readonly sequence: number;
  readonly length: number;
}

export interface Chunk extends Place {
  readonly type: string;
  readonly payload: Uint8Array;
}

/** Read the magic at the start of a stream (5.1-1). */
export function readMagic(source: Source): void {
  const magic = source.read(MAGIC.length);
  demand(isPrefix(MAGIC, magic), "bad-magic", "not a .quarc stream");
  demand(magic.length === MAGIC.length, "truncated", "the stream ends within the magic");
}

/** Whether bytes have the length of a chunk header and start with the sync word (5.2-1). */
export function hasSyncWord(bytes: Uint8Array): boolean {
  return bytes.length === CHUNK_HEADER_BYTES && isPrefix(SYNC_WORD, bytes.subarray(0, 4));
}

/** Whether the first 16 bytes of a chunk header match the CRC in its last 4 bytes (5.2-2). */
export function isHeaderCrcCorrect(bytes: Uint8Array): boolean {
  const crcOffset = CHUNK_HEADER_BYTES - CHUNK_CRC_BYTES;
  return crc32(bytes.subarray(0, crcOffset)) === new Fields(bytes.subarray(crcOffset)).u32("header_crc");
}

/** Parse the fields of a chunk header whose CRC is correct. */
export function parseChunkHeader(bytes: Uint8Array): ChunkHeader {
  const fields = new Fields(bytes.subarray(8));
  const type = String.fromCharCode(...bytes.subarray(4, 8));
  return { type, sequence: fields.u32("sequence"), length: fields.u32("length") };
}

/** Whether a type is ancillary, so that chunks of it may be skipped if it is unknown (5.2). */
export function isAncillary(type: string): boolean {
  return type >= "a";
}

/** Return the length of a whole chunk: header, payload and payload CRC. */
export function chunkLength({ length }: ChunkHeader): number {
  return CHUNK_HEADER_BYTES + length + CHUNK_CRC_BYTES;
}

/** Reads consecutive chunks. */
export class ChunkReader {
  readonly #source: Source;
  readonly #payloadLimit: number;
  readonly #allowsSnapshots: boolean;
  #place: Place;
  #previousType = "";

  /** `source` must be at the offset of `place`; `allowsSnapshots` is whether the type SNAP is known. */
  constructor(source: Source, place: Place, payloadLimit: number, allowsSnapshots: boolean) {
    this.#source = source;
    this.#place = place;
    this.#payloadLimit = payloadLimit;
    this.#allowsSnapshots = allowsSnapshots;
  }

  /** The position after the last chunk whose payload CRC was correct. */
  get place(): Place {
    return this.#place;
  }

  next(): Chunk {
    return this.readPayload(this.readHeader());
  }

  /** Read the next chunk header, and check it. */
  readHeader(): ChunkHeader {
    const bytes = this.#source.read(CHUNK_HEADER_BYTES);
    demand(isPrefix(SYNC_WORD, bytes.subarray(0, 4)), "bad-sync", "a chunk does not begin with the sync word");
    demandWhole(bytes, CHUNK_HEADER_BYTES);
    demand(isHeaderCrcCorrect(bytes), "header-crc", "a chunk header does not match its CRC");
    const header = parseChunkHeader(bytes);
    const expectedSequence = this.#place.sequence;
    demand(
      header.sequence === expectedSequence,
      "sequence",
      `sequence number ${header.sequence} instead of ${expectedSequence}`,
    );
    this.#checkType(header.type);
    this.#checkLength(header);
    return header;
  }

  /** Read and check the payload that follows `header`, the last header that was read. */
  readPayload(header: ChunkHeader): Chunk {
    const { payload, crc } = this.#readPayloadAndCrc(header);
    demand(crc === crc32(payload), "payload-crc", "a payload does not match its CRC");
    return this.#advance(header, payload);
  }

  /** Read the payload that follows `header`, the last header that was read, without checking its CRC. */
  skipPayload(header: ChunkHeader): Chunk {
    return this.#advance(header, this.#readPayloadAndCrc(header).payload);
  }

  /** Check that nothing follows the last chunk (5.1-5). */
  finish(): void {
    demand(this.#source.read(1).length === 0, "trailing-data", "bytes follow TAIL");
  }

  #readPayloadAndCrc({ length }: ChunkHeader) {
    const payload = this.#readExactly(length);
    return { payload, crc: new Fields(this.#readExactly(CHUNK_CRC_BYTES)).u32("payload_crc") };
  }

  #advance(header: ChunkHeader, payload: Uint8Array): Chunk {
    const { offset, sequence } = this.#place;
    this.#place = { offset: offset + chunkLength(header), sequence: sequence + 1 };
    this.#previousType = header.type;
    return { type: header.type, sequence, offset, payload };
  }

  #checkType(type: string): void {
    demand(TYPE_PATTERN.test(type), "bad-chunk-type", "a chunk type matches none of the patterns of 5.2");
    const isKnown =
      isAncillary(type) || KNOWN_CRITICAL_TYPES.has(type) || (this.#allowsSnapshots && type === SNAPSHOT_TYPE);
    demand(isKnown, "unknown-critical", `unknown critical chunk ${type}`);
    const isFirst = this.#place.sequence === 0;
    demand((type === "HEAD") === isFirst, "chunk-order", "the first chunk must be HEAD, and no other may be");
    demand(this.#previousType !== "INDX" || type === "TAIL", "chunk-order", `${type} follows INDX`);
  }

  #checkLength({ type, length }: ChunkHeader): void {
    const message = `a payload has ${length} bytes; the limit is ${this.#payloadLimit}`;
    demand(length <= this.#payloadLimit, "chunk-exceeds-level", message);
    if (length > OWN_LIMITS.payloadBytes)
      throw new Declined(`a payload of ${type} has ${length} bytes; this decoder accepts ${OWN_LIMITS.payloadBytes}`);
  }

  #readExactly(length: number): Uint8Array {
    const bytes = this.#source.read(length);
    demandWhole(bytes, length);
    return bytes;
  }
}

function demandWhole(bytes: Uint8Array, length: number): void {
  demand(bytes.length === length, "truncated", "the stream ends before the end of TAIL");
}

/** Whether `bytes` is a prefix of `expected`. */
function isPrefix(expected: Uint8Array, bytes: Uint8Array): boolean {
  return bytes.every((byte, i) => byte === expected[i]);
}
