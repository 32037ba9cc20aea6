/**
 * Finds the frames of a stream that have arrived, by reading chunk headers (SPEC 5.2).
 *
 * The last of these frames is the newest frame of a live stream, or the last frame of a stream without an index. CRCs
 * are not checked here; the decoder checks the CRCs of all frames that are shown.
 */

import type { StreamBytes } from "./stream-bytes.js";

const MAGIC_BYTES = 8;
const HEADER_BYTES = 20;
const CRC_BYTES = 4;
const SYNC_WORD = 0xf343519e; // the sync word in little-endian order
const TYPE_OFFSET = 4;
const LENGTH_OFFSET = 12;
const ORDINAL_BYTES = 4; // at the start of CANO and SNAP

export class ChunkWalk {
  /** Ordinal of the last complete frame; null before the first complete frame. */
  lastFrame: number | null = null;
  /** Offset of the next byte that is needed. */
  nextOffset = MAGIC_BYTES;
  /** Whether the walk has reached the end of the stream: TAIL, or bytes that are not a chunk. */
  hasEnded = false;
  readonly #bytes: StreamBytes;
  #chunkOffset = MAGIC_BYTES; // offset of the next chunk

  constructor(bytes: StreamBytes) {
    this.#bytes = bytes;
  }

  /**
   * Continue through the available bytes. Return whether the walk has reached the end of the stream, or the current end
   * of a live stream.
   */
  advance(): boolean {
    while (!this.hasEnded) {
      const { size } = this.#bytes;
      const header = this.#read(this.#chunkOffset, HEADER_BYTES + ORDINAL_BYTES);
      if (header === null) return size !== null && this.#chunkOffset + HEADER_BYTES + ORDINAL_BYTES > size;
      if (header.getUint32(0, true) !== SYNC_WORD) break;
      const end = this.#chunkOffset + HEADER_BYTES + header.getUint32(LENGTH_OFFSET, true) + CRC_BYTES;
      if (size === null && this.#read(end - 1, 1) === null) return false;
      if (size !== null && end > size) {
        this.nextOffset = size;
        return true;
      }
      this.#countFrame(header);
      this.#chunkOffset = this.nextOffset = end;
    }
    this.hasEnded = true;
    return true;
  }

  #countFrame(header: DataView): void {
    const chunkType = String.fromCharCode(...new Uint8Array(header.buffer, TYPE_OFFSET, 4));
    if (chunkType === "CANO" || chunkType === "SNAP") this.lastFrame = header.getUint32(HEADER_BYTES, true);
    else if (chunkType === "FRAM" && this.lastFrame !== null) this.lastFrame += 1;
    this.hasEnded = chunkType === "TAIL";
  }

  /** Read bytes of the stream; if some are missing, set `nextOffset` to the first missing byte and return null. */
  #read(offset: number, length: number): DataView | null {
    const bytes = new Uint8Array(length);
    for (let readCount = 0; readCount < length; ) {
      this.nextOffset = offset + readCount;
      const piece = this.#bytes.findAvailable(this.nextOffset);
      if (piece === null) return null;
      bytes.set(piece.subarray(0, length - readCount), readCount);
      readCount += piece.length;
    }
    return new DataView(bytes.buffer);
  }
}
