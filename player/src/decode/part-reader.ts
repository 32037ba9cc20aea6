/** The bytes of a source that a decoder lacks, by as few requests as will do. */

import type { Range } from "./quarc.js";
import type { ByteSource, Piece } from "./source.js";

const SKIP_BYTES = 1 << 17; // what is sooner read than asked for anew
const END_BYTES = 1 << 16; // of a stream, which hold TAIL and, most often, INDX

export class PartReader {
  /** Bytes that have come. */
  received = 0;
  readonly #source: ByteSource;
  readonly #signal: AbortSignal;
  #pieces: AsyncGenerator<Piece, void, void> | null = null;
  #place = 0;

  constructor(source: ByteSource, signal: AbortSignal) {
    this.#source = source;
    this.#signal = signal;
  }

  /** The next piece on the way to a range; null where the stream ends before it. */
  async next(range: Range): Promise<Piece | null> {
    if (!this.#leadsTo(range.begin)) {
      await this.close();
      this.#pieces = this.#source.read(range.begin, this.#signal);
      this.#place = range.begin;
    }
    const { done, value } = (await this.#pieces?.next()) ?? { done: true, value: undefined };
    if (done === true || value === undefined) return null;
    this.#place = value.offset + value.bytes.length;
    this.received += value.bytes.length;
    return value;
  }

  async close(): Promise<void> {
    const pieces = this.#pieces;
    this.#pieces = null;
    await pieces?.return();
  }

  #leadsTo(place: number): boolean {
    if (this.#pieces === null || place < this.#place) return false;
    return !this.#source.hasRanges || place < this.#place + SKIP_BYTES;
  }
}

/** The last bytes of a source whose size is known, in one piece. */
export async function readEnd(source: ByteSource, size: number, signal: AbortSignal): Promise<Piece> {
  const offset = Math.max(0, size - END_BYTES);
  const bytes = new Uint8Array(size - offset);
  let place = offset;
  for await (const piece of source.read(offset, signal)) {
    bytes.set(piece.bytes, piece.offset - offset);
    place = piece.offset + piece.bytes.length;
    if (place >= size) break;
  }
  return { offset, bytes: bytes.subarray(0, place - offset) };
}
