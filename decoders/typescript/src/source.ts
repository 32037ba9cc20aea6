/** Sequential sources of bytes in memory or files. */

import { readSync } from "node:fs";

/** A source of a stream. */
export interface Source {
  /** The next `length` bytes, or fewer at the end of the stream. */
  read(length: number): Uint8Array;
}

/** A stream in memory, from `offset` on. */
export class MemorySource implements Source {
  readonly #bytes: Uint8Array;
  #offset: number;

  constructor(bytes: Uint8Array, offset = 0) {
    this.#bytes = bytes;
    this.#offset = offset;
  }

  read(length: number): Uint8Array {
    const start = this.#offset;
    this.#offset = Math.min(start + length, this.#bytes.length);
    return this.#bytes.subarray(start, this.#offset);
  }
}

/** Memory for a payload grows with the received bytes, not with the length in a header (SPEC 13-1). */
const PIECE_BYTES = 1 << 20;

const RETRY_MILLISECONDS = 5;

/** A stream in an open file or pipe. */
export class FileSource implements Source {
  constructor(readonly descriptor: number) {}

  read(length: number): Uint8Array {
    const pieces: Uint8Array[] = [];
    let due = length;
    while (due > 0) {
      const size = Math.min(due, PIECE_BYTES);
      const piece = this.#readPiece(size);
      pieces.push(piece);
      if (piece.length < size) break;
      due -= size;
    }
    return pieces.length === 1 ? pieces[0] : Buffer.concat(pieces);
  }

  #readPiece(size: number): Uint8Array {
    const piece = Buffer.allocUnsafe(size);
    let filled = 0;
    while (filled < size) {
      const count = readSome(this.descriptor, piece.subarray(filled));
      if (count === 0) break;
      filled += count;
    }
    return piece.subarray(0, filled);
  }
}

/** Read at least one byte, or none at the end; waits for a pipe. */
export function readSome(descriptor: number, piece: Uint8Array): number {
  for (;;) {
    try {
      return readSync(descriptor, piece);
    } catch (error) {
      const code = (error as NodeJS.ErrnoException).code;
      if (code === "EOF") return 0;
      if (code !== "EAGAIN") throw error;
      Atomics.wait(new Int32Array(new SharedArrayBuffer(4)), 0, 0, RETRY_MILLISECONDS);
    }
  }
}
