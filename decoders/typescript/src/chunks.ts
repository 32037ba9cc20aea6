/**
 * The chunks of a stream (SPEC 5.1, 5.2): framing, CRCs, types, sequence and order. Payloads are not interpreted here;
 * only the limit of their length is needed.
 */

import { CHUNK_CRC_BYTES, CHUNK_HEADER_BYTES, OWN_LIMITS } from "./constants.js";
import { crc32 } from "./crc.js";
import { Fields } from "./fields.js";
import { Declined, demand } from "./reject.js";
import type { Source } from "./source.js";

const MAGIC = Uint8Array.of(0x89, 0x51, 0x52, 0x43, 0x0d, 0x0a, 0x1a, 0x0a);
export const SYNC_WORD = Uint8Array.of(0x9e, 0x51, 0x43, 0xf3);
const KNOWN_CRITICAL: ReadonlySet<string> = new Set(["HEAD", "CANO", "FRAM", "INDX", "TAIL"]);

/** The critical type that is known only in streams with FEATURE_SNAPSHOTS (5.10). */
const SNAPSHOT_TYPE = "SNAP";

/** The patterns of 5.2: the third and fourth letter have the case of the first, the second may have either. */
const TYPE_PATTERN = /^(?:[A-Z][A-Za-z][A-Z]{2}|[a-z][A-Za-z][a-z]{2})$/;

/** Position and sequence number of the next chunk. */
export interface Place {
  /** In bytes from the start of the stream. */
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
  demand(beginsWith(MAGIC, magic), "bad-magic", "not a .quarc stream");
  demand(magic.length === MAGIC.length, "truncated", "the stream ends within the magic");
}

/** Whether bytes have the length of a chunk header and start with the sync word (5.2-1). */
export function isSynced(bytes: Uint8Array): boolean {
  return bytes.length === CHUNK_HEADER_BYTES && beginsWith(SYNC_WORD, bytes.subarray(0, 4));
}

/** Whether the first 16 bytes of a chunk header match the CRC in the other 4 (5.2-2). */
export function headerCrcHolds(bytes: Uint8Array): boolean {
  const proved = CHUNK_HEADER_BYTES - CHUNK_CRC_BYTES;
  return crc32(bytes.subarray(0, proved)) === new Fields(bytes.subarray(proved)).u32("header_crc");
}

/** The fields of a chunk header with a correct CRC. */
export function parseChunkHeader(bytes: Uint8Array): ChunkHeader {
  const fields = new Fields(bytes.subarray(8));
  const type = String.fromCharCode(...bytes.subarray(4, 8));
  return { type, sequence: fields.u32("sequence"), length: fields.u32("length") };
}

/** Whether a chunk of this type may be skipped if it is unknown (5.2). */
export function isAncillary(type: string): boolean {
  return type >= "a";
}

/** The length of a chunk with its header and the CRC of its payload. */
export function chunkBytes({ length }: ChunkHeader): number {
  return CHUNK_HEADER_BYTES + length + CHUNK_CRC_BYTES;
}

/** Reads consecutive chunks. */
export class ChunkReader {
  readonly #source: Source;
  readonly #payloadLimit: number;
  readonly #snapshots: boolean;
  #place: Place;
  #typeBefore = "";

  /** `source` is at the first byte of the chunk at `place`; `snapshots` is whether SNAP is known. */
  constructor(source: Source, place: Place, payloadLimit: number, snapshots: boolean) {
    this.#source = source;
    this.#place = place;
    this.#payloadLimit = payloadLimit;
    this.#snapshots = snapshots;
  }

  /** The position after the last chunk whose payload CRC was correct. */
  get place(): Place {
    return this.#place;
  }

  next(): Chunk {
    return this.readPayload(this.readHeader());
  }

  /** Read the next header, and check everything that does not need the payload. */
  readHeader(): ChunkHeader {
    const bytes = this.#readWhole(CHUNK_HEADER_BYTES);
    demand(beginsWith(SYNC_WORD, bytes.subarray(0, 4)), "bad-sync", "a chunk does not begin with the sync word");
    demand(headerCrcHolds(bytes), "header-crc", "a chunk header does not match its CRC");
    const header = parseChunkHeader(bytes);
    const due = this.#place.sequence;
    demand(header.sequence === due, "sequence", `sequence number ${header.sequence} instead of ${due}`);
    this.#checkType(header.type);
    this.#checkLength(header);
    return header;
  }

  /** Read the rest of the chunk of `header`, which must have been read last. */
  readPayload(header: ChunkHeader): Chunk {
    const { payload, crc } = this.#readRest(header);
    demand(crc === crc32(payload), "payload-crc", "a payload does not match its CRC");
    return this.#advance(header, payload);
  }

  /** Skip the rest of the chunk of `header`, which must have been read last, without checking its payload. */
  passOver(header: ChunkHeader): Chunk {
    return this.#advance(header, this.#readRest(header).payload);
  }

  /** Check that nothing follows the last chunk (5.1-5). */
  finish(): void {
    demand(this.#source.read(1).length === 0, "trailing-data", "bytes follow TAIL");
  }

  #readRest({ length }: ChunkHeader) {
    const payload = this.#readWhole(length);
    return { payload, crc: new Fields(this.#readWhole(CHUNK_CRC_BYTES)).u32("payload_crc") };
  }

  #advance(header: ChunkHeader, payload: Uint8Array): Chunk {
    const { offset, sequence } = this.#place;
    this.#place = { offset: offset + chunkBytes(header), sequence: sequence + 1 };
    this.#typeBefore = header.type;
    return { type: header.type, sequence, offset, payload };
  }

  #checkType(type: string): void {
    demand(TYPE_PATTERN.test(type), "bad-chunk-type", "a chunk type matches none of the patterns");
    const first = this.#place.sequence === 0;
    demand((type === "HEAD") === first, "chunk-order", "the first chunk must be HEAD, and no other may be");
    const known = isAncillary(type) || KNOWN_CRITICAL.has(type) || (this.#snapshots && type === SNAPSHOT_TYPE);
    demand(known, "unknown-critical", `unknown critical chunk ${type}`);
    demand(this.#typeBefore !== "INDX" || type === "TAIL", "chunk-order", `${type} follows INDX`);
  }

  #checkLength({ type, length }: ChunkHeader): void {
    const message = `a payload of ${length} bytes; the limit is ${this.#payloadLimit}`;
    demand(length <= this.#payloadLimit, "chunk-exceeds-level", message);
    if (length > OWN_LIMITS.payloadBytes) throw new Declined(`a ${type} payload of ${length} bytes`);
  }

  #readWhole(length: number): Uint8Array {
    const bytes = this.#source.read(length);
    demand(bytes.length === length, "truncated", "the stream ends before TAIL does");
    return bytes;
  }
}

/** Whether `bytes` is a prefix of `whole`. */
function beginsWith(whole: Uint8Array, bytes: Uint8Array): boolean {
  return bytes.every((byte, i) => byte === whole[i]);
}
