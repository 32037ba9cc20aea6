/**
 * A stream as chunks (SPEC 5.1, 5.2): framing, CRCs, types, sequence and order. What a payload says is not
 * this file's business; it is told only how long a payload may be.
 */

import { CHUNK_CRC_BYTES, CHUNK_HEADER_BYTES, HEAD_BYTES_LIMIT, OWN_LIMITS } from "./constants.js";
import { crc32 } from "./crc.js";
import { Fields } from "./fields.js";
import { Declined, demand } from "./reject.js";
import type { Source } from "./source.js";

const MAGIC = Uint8Array.of(0x89, 0x51, 0x52, 0x43, 0x0d, 0x0a, 0x1a, 0x0a);
const SYNC = 0xf343519e;
const KNOWN_CRITICAL: ReadonlySet<string> = new Set(["HEAD", "CANO", "FRAM", "INDX", "TAIL"]);

/** The patterns of 5.2: the third and the fourth letter have the case of the first, the second may have either. */
const TYPE_PATTERN = /^(?:[A-Z][A-Za-z][A-Z]{2}|[a-z][A-Za-z][a-z]{2})$/;

export interface Chunk {
  readonly type: string;
  readonly sequence: number;
  /** Where the chunk begins, in bytes from the start of the stream. */
  readonly offset: number;
  readonly payload: Uint8Array;
}

interface ChunkHeader {
  readonly type: string;
  readonly sequence: number;
  readonly length: number;
}

export class ChunkReader {
  /** The most bytes of a payload; of HEAD at first, then to be set to those of the level. */
  payloadLimit = HEAD_BYTES_LIMIT;

  readonly #source: Source;
  #offset = 0;
  #sequence = 0;
  #typeBefore = "";
  #canonicalSeen = false;

  constructor(source: Source) {
    this.#source = source;
    const magic = this.#read(MAGIC.length);
    demand(
      magic.every((byte, i) => byte === MAGIC[i]),
      "bad-magic",
      "not a .quarc stream",
    );
    demand(magic.length === MAGIC.length, "truncated", "the stream ends within the magic");
  }

  /** The chunks up to TAIL, behind which nothing follows. */
  *chunks(): Generator<Chunk, void, undefined> {
    while (this.#typeBefore !== "TAIL") {
      const offset = this.#offset;
      const header = this.#readHeader();
      this.#checkOrder(header.type);
      this.#checkLength(header);
      const payload = this.#readPayload(header.length);
      if (header.type === "TAIL") {
        demand(this.#read(1).length === 0, "trailing-data", "bytes follow TAIL");
      }
      this.#accept(header.type);
      yield { type: header.type, sequence: header.sequence, offset, payload };
    }
  }

  #readHeader(): ChunkHeader {
    const bytes = this.#readWhole(CHUNK_HEADER_BYTES);
    const fields = new Fields(bytes);
    demand(fields.u32("sync") === SYNC, "bad-sync", "a chunk does not begin with the sync word");
    const type = String.fromCharCode(...bytes.subarray(4, 8));
    fields.u32("type");
    const sequence = fields.u32("sequence");
    const length = fields.u32("length");
    const crc = crc32(bytes.subarray(0, CHUNK_HEADER_BYTES - CHUNK_CRC_BYTES));
    demand(fields.u32("header_crc") === crc, "header-crc", "a chunk header does not match its CRC");
    demand(sequence === this.#sequence, "sequence", `sequence is ${sequence}, not ${this.#sequence}`);
    return { type, sequence, length };
  }

  #checkOrder(type: string): void {
    demand(TYPE_PATTERN.test(type), "bad-chunk-type", "a type is not four letters in one of the patterns");
    const critical = type < "a";
    demand((type === "HEAD") === (this.#typeBefore === ""), "chunk-order", "HEAD is the first chunk, and no other is");
    demand(!critical || KNOWN_CRITICAL.has(type), "unknown-critical", `no decoder of this version knows ${type}`);
    demand(this.#typeBefore !== "INDX" || type === "TAIL", "chunk-order", `${type} follows INDX`);
    demand(type !== "FRAM" || this.#canonicalSeen, "chunk-order", "FRAM comes before the first CANO");
  }

  #checkLength({ type, length }: ChunkHeader): void {
    const message = `a payload of ${length} bytes: ${this.payloadLimit} are allowed`;
    demand(length <= this.payloadLimit, "chunk-exceeds-level", message);
    if (length > OWN_LIMITS.payloadBytes) throw new Declined(`a ${type} payload of ${length} bytes`);
  }

  #readPayload(length: number): Uint8Array {
    const payload = this.#readWhole(length);
    const crc = new Fields(this.#readWhole(CHUNK_CRC_BYTES)).u32("payload_crc");
    demand(crc === crc32(payload), "payload-crc", "a payload does not match its CRC");
    return payload;
  }

  #accept(type: string): void {
    this.#sequence += 1;
    this.#typeBefore = type;
    this.#canonicalSeen ||= type === "CANO";
  }

  #readWhole(length: number): Uint8Array {
    const bytes = this.#read(length);
    demand(bytes.length === length, "truncated", "the stream ends before TAIL does");
    return bytes;
  }

  #read(length: number): Uint8Array {
    const bytes = this.#source.read(length);
    this.#offset += bytes.length;
    return bytes;
  }
}
