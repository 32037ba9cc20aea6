/**
 * The bytes of a stream as the decoder requests them: in memory, or from a server.
 *
 * Received bytes are kept, up to a limit, so that seeking back and looping request nothing twice. A response is read on
 * as long as it leads to the wanted bytes. It belongs to the stream and not to a seek, so that a seek does not restart
 * a download.
 */

import type { StreamSource } from "../protocol.js";
import { HttpSource, type Piece } from "./source.js";

const BLOCK_BYTES = 1 << 16;
const BLOCKS = 1024; // maximum number kept: 64 MiB
const SKIP_BYTES = 1 << 17; // reading past so many bytes is faster than a new request
const END_BYTES = 1 << 12; // contains TAIL and, for most streams, INDX

export interface StreamBytes {
  /** Size of the stream, if known. */
  readonly size: number | null;
  /** Whether its end can be read before its start. */
  readonly isSeekable: boolean;
  readonly isLive: boolean;
  /** Bytes received so far. */
  readonly received: number;
  /** Return the available bytes from an offset on without a request; null if there are none. */
  find(place: number): Uint8Array | null;
  /** Return some bytes from an offset on, or null at the end of the stream. */
  next(place: number, signal: AbortSignal): Promise<Piece | null>;
  /** Request the end of the stream in parallel, and keep it. */
  prefetchEnd(): Promise<void>;
  close(): void;
}

export function makeStreamBytes(source: StreamSource): StreamBytes {
  return "bytes" in source ? new MemoryBytes(new Uint8Array(source.bytes)) : new ReceivedBytes(new HttpSource(source));
}

class MemoryBytes implements StreamBytes {
  readonly isSeekable = true;
  readonly isLive = false;
  readonly #bytes: Uint8Array;

  constructor(bytes: Uint8Array) {
    this.#bytes = bytes;
  }

  get size(): number {
    return this.#bytes.length;
  }

  get received(): number {
    return this.#bytes.length;
  }

  find(place: number): Uint8Array | null {
    return place < this.size ? this.#bytes.subarray(place, place + BLOCK_BYTES) : null;
  }

  async next(place: number): Promise<Piece | null> {
    const bytes = this.find(place);
    return bytes === null ? null : { offset: place, bytes };
  }

  async prefetchEnd(): Promise<void> {}

  close(): void {}
}

/** A response that is still arriving. */
interface Download {
  readonly pieces: AsyncGenerator<Piece, void, void>;
  readonly abort: AbortController;
  /** Offset of its next piece. */
  place: number;
  /** Resolves when that piece has been stored: false if the response has ended. */
  coming: Promise<boolean> | null;
}

class ReceivedBytes implements StreamBytes {
  received = 0;
  readonly #source: HttpSource;
  readonly #kept = new Kept();
  readonly #ended = new AbortController();
  #download: Download | null = null;

  constructor(source: HttpSource) {
    this.#source = source;
  }

  get size(): number | null {
    return this.#source.size;
  }

  get isSeekable(): boolean {
    return this.#source.hasRanges && this.size !== null && !this.isLive;
  }

  get isLive(): boolean {
    return this.#source.isLive;
  }

  find(place: number): Uint8Array | null {
    return this.#kept.find(place);
  }

  async next(place: number, signal: AbortSignal): Promise<Piece | null> {
    for (;;) {
      signal.throwIfAborted();
      const bytes = this.find(place);
      if (bytes !== null) return { offset: place, bytes };
      if (this.size !== null && place >= this.size && !this.isLive) return null;
      const download = this.#find(place);
      download.coming ??= this.#receive(download);
      // If a seek aborts the wait, the piece is stored all the same.
      if (!(await unlessAborted(download.coming, signal))) return null;
    }
  }

  async prefetchEnd(): Promise<void> {
    const { size } = this;
    if (size === null || !this.isSeekable || this.#kept.find(size - 1) !== null) return;
    for await (const piece of this.#source.read(Math.max(0, size - END_BYTES), this.#ended.signal)) {
      this.#keep(piece);
    }
  }

  close(): void {
    this.#download?.abort.abort();
    this.#ended.abort();
  }

  /** The download that leads to an offset; a new one if the current one does not. */
  #find(place: number): Download {
    const known = this.#download;
    const reach = this.#source.hasRanges ? SKIP_BYTES : Infinity;
    if (known !== null && known.place <= place && place < known.place + reach) return known;
    known?.abort.abort();
    const abort = new AbortController();
    const pieces = this.#source.read(place, abort.signal);
    this.#download = { pieces, abort, place, coming: null };
    return this.#download;
  }

  async #receive(download: Download): Promise<boolean> {
    let isOver = true;
    try {
      const { value } = await download.pieces.next();
      if (value === undefined) return false;
      this.#keep(value);
      download.place = value.offset + value.bytes.length;
      isOver = false;
      return true;
    } finally {
      download.coming = null;
      if (isOver && this.#download === download) this.#download = null;
    }
  }

  #keep({ offset, bytes }: Piece): void {
    this.received += bytes.length;
    this.#kept.add(offset, bytes);
  }
}

/** A block of a stream whose bytes from `begin` up to `end` are known. */
interface Block {
  readonly bytes: Uint8Array;
  begin: number;
  end: number;
}

/** Bytes by offset; the oldest blocks are dropped. */
class Kept {
  readonly #blocks = new Map<number, Block>();

  add(offset: number, bytes: Uint8Array): void {
    for (let done = 0; done < bytes.length; ) {
      const within = (offset + done) % BLOCK_BYTES;
      const length = Math.min(bytes.length - done, BLOCK_BYTES - within);
      const block = this.#blockOf(Math.floor((offset + done) / BLOCK_BYTES));
      block.bytes.set(bytes.subarray(done, done + length), within);
      const isApart = within > block.end || within + length < block.begin;
      block.begin = isApart ? within : Math.min(block.begin, within);
      block.end = isApart ? within + length : Math.max(block.end, within + length);
      done += length;
    }
  }

  /** The known bytes from an offset on, within its block; null if there are none. */
  find(place: number): Uint8Array | null {
    const block = this.#blocks.get(Math.floor(place / BLOCK_BYTES));
    const within = place % BLOCK_BYTES;
    if (block === undefined || within < block.begin || within >= block.end) return null;
    return block.bytes.subarray(within, block.end);
  }

  #blockOf(number: number): Block {
    const known = this.#blocks.get(number);
    if (known !== undefined) return known;
    const block = { bytes: new Uint8Array(BLOCK_BYTES), begin: BLOCK_BYTES, end: 0 };
    this.#blocks.set(number, block);
    const [oldest] = this.#blocks.keys();
    if (this.#blocks.size > BLOCKS && oldest !== undefined) this.#blocks.delete(oldest);
    return block;
  }
}

/** The result of a promise, unless the signal aborts first. */
export function unlessAborted<T>(promise: Promise<T>, signal: AbortSignal): Promise<T> {
  return new Promise((resolve, reject) => {
    const abort = (): void => reject(signal.reason as Error);
    signal.addEventListener("abort", abort, { once: true });
    promise.then(resolve, reject).finally(() => signal.removeEventListener("abort", abort));
  });
}
