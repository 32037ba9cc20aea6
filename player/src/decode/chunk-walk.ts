/**
 * Finds the frames of a stream that have arrived, by reading chunk headers (SPEC 5.2).
 *
 * This gives the current end of a live stream, and the last frame of a stream without an index. Headers are not
 * verified here; the decoder verifies what is shown.
 */

import type { StreamBytes } from "./stream-bytes.js";

const MAGIC_BYTES = 8;
const HEADER_BYTES = 20;
const CRC_BYTES = 4;
const SYNC = 0xf343519e; // the sync word in little-endian order
const KIND_AT = 4;
const LENGTH_AT = 12;
const ORDINAL_BYTES = 4; // at the start of CANO and SNAP

export class ChunkWalk {
  /** Ordinal of the last complete frame; null before the first. */
  lastFrame: number | null = null;
  /** The next byte that is needed. */
  place = MAGIC_BYTES;
  /** Whether the stream has ended: after TAIL, or where there is no chunk. */
  isEnded = false;
  readonly #bytes: StreamBytes;
  #chunk = MAGIC_BYTES; // offset of the next chunk

  constructor(bytes: StreamBytes) {
    this.#bytes = bytes;
  }

  /**
   * Read on through the available bytes. Returns whether all known frames have been found; frames of a live stream that
   * the server has not announced follow later.
   */
  advance(): boolean {
    while (!this.isEnded) {
      const { size } = this.#bytes;
      const head = this.#read(this.#chunk, HEADER_BYTES + ORDINAL_BYTES);
      if (head === null) return size !== null && this.#chunk + HEADER_BYTES + ORDINAL_BYTES > size;
      if (head.getUint32(0, true) !== SYNC) break;
      const end = this.#chunk + HEADER_BYTES + head.getUint32(LENGTH_AT, true) + CRC_BYTES;
      if (size === null && this.#read(end - 1, 1) === null) return false;
      if (size !== null && end > size) {
        this.place = size;
        return true;
      }
      this.#count(head);
      this.#chunk = this.place = end;
    }
    this.isEnded = true;
    return true;
  }

  #count(head: DataView): void {
    const kind = String.fromCharCode(...new Uint8Array(head.buffer, KIND_AT, 4));
    if (kind === "CANO" || kind === "SNAP") this.lastFrame = head.getUint32(HEADER_BYTES, true);
    else if (kind === "FRAM" && this.lastFrame !== null) this.lastFrame += 1;
    this.isEnded = kind === "TAIL";
  }

  /** Bytes of the stream; if some are missing, sets `place` to the first of them and returns null. */
  #read(from: number, length: number): DataView | null {
    const bytes = new Uint8Array(length);
    for (let done = 0; done < length; ) {
      this.place = from + done;
      const piece = this.#bytes.find(this.place);
      if (piece === null) return null;
      bytes.set(piece.subarray(0, length - done), done);
      done += piece.length;
    }
    return new DataView(bytes.buffer);
  }
}
