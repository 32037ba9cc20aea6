/** Sources from which bytes are read sequentially, memory and files; and the output, which is a file, too. */

import { readSync, writeSync } from "node:fs";

/** A source of the bytes of a stream. */
export interface Source {
  /** Read the next `length` bytes, or fewer at the end of the stream. */
  read(length: number): Uint8Array;
}

/** A stream in memory, read from `offset` onwards. */
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

/** Size of pieces: memory grows with the received bytes, not with the length in a chunk header (SPEC 13-1). */
const PIECE_BYTES = 1 << 20;

const RETRY_MILLISECONDS = 5;

/** A stream in an open file or pipe. */
export class FileSource implements Source {
  constructor(readonly descriptor: number) {}

  read(length: number): Uint8Array {
    const pieces: Uint8Array[] = [];
    let remaining = length;
    while (remaining > 0) {
      const pieceBytes = Math.min(remaining, PIECE_BYTES);
      const piece = this.#readPiece(pieceBytes);
      pieces.push(piece);
      if (piece.length < pieceBytes) break;
      remaining -= pieceBytes;
    }
    return pieces.length === 1 ? pieces[0] : Buffer.concat(pieces);
  }

  #readPiece(pieceBytes: number): Uint8Array {
    const piece = Buffer.allocUnsafe(pieceBytes);
    let filledBytes = 0;
    while (filledBytes < pieceBytes) {
      const count = readSome(this.descriptor, piece.subarray(filledBytes));
      if (count === 0) break;
      filledBytes += count;
    }
    return piece.subarray(0, filledBytes);
  }
}

/** Read at least one byte, waiting for a pipe if necessary; return the number of bytes, 0 at the end. */
export function readSome(descriptor: number, piece: Uint8Array): number {
  try {
    return waitFor(() => readSync(descriptor, piece));
  } catch (error) {
    if ((error as NodeJS.ErrnoException).code === "EOF") return 0;
    throw error;
  }
}

/** Write all bytes, waiting for the reader of a pipe if necessary. */
export function writeAll(descriptor: number, bytes: Uint8Array): void {
  for (let written = 0; written < bytes.length; ) {
    const rest = bytes.subarray(written);
    written += waitFor(() => writeSync(descriptor, rest));
  }
}

/** Repeat an operation until the pipe is ready for it. */
function waitFor(operate: () => number): number {
  for (;;) {
    try {
      return operate();
    } catch (error) {
      if ((error as NodeJS.ErrnoException).code !== "EAGAIN") throw error;
      Atomics.wait(new Int32Array(new SharedArrayBuffer(4)), 0, 0, RETRY_MILLISECONDS);
    }
  }
}
