/**
 * Provides the bytes of a stream to the decoder, from memory or from a server.
 *
 * Received bytes are kept in a cache, so that seeking back and looping need no new requests. A download continues as long
 * as it leads to the bytes that are needed; a seek does not restart it.
 */

import type { StreamSource } from "../protocol.js";
import { HttpSource, type Piece } from "./source.js";

const BLOCK_BYTES = 1 << 16;
const MAX_BLOCKS = 1024; // size of the cache: 64 MiB
const MAX_SKIP_BYTES = 1 << 17; // skipping so many bytes of a response is faster than a new request
const PREFETCH_BYTES = 1 << 12; // contains TAIL and, for most streams, INDX

export interface StreamBytes {
  /** Size of the stream in bytes; null if unknown. */
  readonly size: number | null;
  /** Whether the end of the stream can be read before its start. */
  readonly isSeekable: boolean;
  readonly isLive: boolean;
  /** Number of bytes received so far. */
  readonly receivedBytes: number;
  /** Return available bytes from an offset onwards, without a request; null if the byte at the offset is missing. */
  findAvailable(offset: number): Uint8Array | null;
  /** Return some bytes from an offset onwards, or null at the end of the stream. */
  readPiece(offset: number, signal: AbortSignal): Promise<Piece | null>;
  /**
   * Request the missing bytes from an offset to the end of the stream for the cache, in parallel to the download, unless
   * the download soon reaches them.
   */
  prefetchEnd(offset: number): Promise<void>;
  close(): void;
}

export function makeStreamBytes(source: StreamSource): StreamBytes {
  if ("bytes" in source) return new MemoryBytes(new Uint8Array(source.bytes));
  const bytes = decodeDataUrl(source.url);
  return bytes === null ? new ReceivedBytes(new HttpSource(source)) : new MemoryBytes(bytes);
}

/** Return the bytes of a data URL in base64, which a request would give only in sequence; null for any other URL. */
function decodeDataUrl(url: string): Uint8Array | null {
  const base64 = /^data:[^,]*;base64,(.*)$/i.exec(url)?.[1];
  if (base64 === undefined) return null;
  try {
    const text = atob(base64);
    const bytes = new Uint8Array(text.length); // `Uint8Array.from` would need many times the memory
    for (let index = 0; index < bytes.length; index++) bytes[index] = text.charCodeAt(index);
    return bytes;
  } catch {
    return null; // the request reports the error
  }
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

  get receivedBytes(): number {
    return this.#bytes.length;
  }

  findAvailable(offset: number): Uint8Array | null {
    return offset < this.size ? this.#bytes.subarray(offset, offset + BLOCK_BYTES) : null;
  }

  async readPiece(offset: number): Promise<Piece | null> {
    const bytes = this.findAvailable(offset);
    return bytes === null ? null : { offset, bytes };
  }

  async prefetchEnd(): Promise<void> {}

  close(): void {}
}

/** A response that is still arriving. */
interface Download {
  readonly pieces: AsyncGenerator<Piece, void, void>;
  readonly abortController: AbortController;
  /** Offset of the next piece. */
  nextOffset: number;
  /** Resolves when the next piece has been stored, to true; or when the response has ended, to false. */
  pendingPiece: Promise<boolean> | null;
}

class ReceivedBytes implements StreamBytes {
  receivedBytes = 0;
  readonly #source: HttpSource;
  readonly #cache = new BlockCache();
  readonly #abortController = new AbortController();
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

  findAvailable(offset: number): Uint8Array | null {
    return this.#cache.find(offset);
  }

  async readPiece(offset: number, signal: AbortSignal): Promise<Piece | null> {
    for (;;) {
      signal.throwIfAborted();
      const bytes = this.findAvailable(offset);
      if (bytes !== null) return { offset, bytes };
      if (this.size !== null && offset >= this.size && !this.isLive) return null;
      const download = this.#findDownload(offset);
      download.pendingPiece ??= this.#receivePiece(download);
      // The piece is stored even if a seek stops waiting for it.
      if (!(await unlessAborted(download.pendingPiece, signal))) return null;
    }
  }

  async prefetchEnd(offset: number): Promise<void> {
    const { size } = this;
    if (size === null || this.#cache.find(offset) !== null || this.#reachesSoon(offset)) return;
    const begin = Math.max(0, Math.min(offset, size - PREFETCH_BYTES));
    for await (const piece of this.#source.read(begin, this.#abortController.signal)) this.#store(piece);
  }

  close(): void {
    this.#download?.abortController.abort();
    this.#abortController.abort();
  }

  /** Return the current download if it soon reaches an offset; otherwise start a new download. */
  #findDownload(offset: number): Download {
    const current = this.#download;
    if (current !== null && this.#reachesSoon(offset)) return current;
    current?.abortController.abort();
    const abortController = new AbortController();
    const pieces = this.#source.read(offset, abortController.signal);
    this.#download = { pieces, abortController, nextOffset: offset, pendingPiece: null };
    return this.#download;
  }

  /** Whether the current download soon reaches an offset. */
  #reachesSoon(offset: number): boolean {
    const { nextOffset = Infinity } = this.#download ?? {};
    const maxSkipBytes = this.#source.hasRanges ? MAX_SKIP_BYTES : Infinity;
    return nextOffset <= offset && offset < nextOffset + maxSkipBytes;
  }

  async #receivePiece(download: Download): Promise<boolean> {
    let hasEnded = true;
    try {
      const { value } = await download.pieces.next();
      if (value === undefined) return false;
      this.#store(value);
      download.nextOffset = value.offset + value.bytes.length;
      hasEnded = false;
      return true;
    } finally {
      download.pendingPiece = null;
      if (hasEnded && this.#download === download) this.#download = null;
    }
  }

  #store({ offset, bytes }: Piece): void {
    this.receivedBytes += bytes.length;
    this.#cache.add(offset, bytes);
  }
}

/** A block of a stream whose bytes from `begin` to `end` (exclusive) are available. */
interface Block {
  readonly bytes: Uint8Array;
  begin: number;
  end: number;
}

/** A cache of bytes by offset; when it is full, the oldest block is dropped. */
class BlockCache {
  readonly #blocks = new Map<number, Block>();

  add(offset: number, bytes: Uint8Array): void {
    for (let storedBytes = 0; storedBytes < bytes.length; ) {
      const blockOffset = (offset + storedBytes) % BLOCK_BYTES;
      const length = Math.min(bytes.length - storedBytes, BLOCK_BYTES - blockOffset);
      const block = this.#findOrAddBlock(Math.floor((offset + storedBytes) / BLOCK_BYTES));
      block.bytes.set(bytes.subarray(storedBytes, storedBytes + length), blockOffset);
      const isDisjoint = blockOffset > block.end || blockOffset + length < block.begin;
      block.begin = isDisjoint ? blockOffset : Math.min(block.begin, blockOffset);
      block.end = isDisjoint ? blockOffset + length : Math.max(block.end, blockOffset + length);
      storedBytes += length;
    }
  }

  /** Return the available bytes from an offset to the end of its block; null if the byte at the offset is missing. */
  find(offset: number): Uint8Array | null {
    const block = this.#blocks.get(Math.floor(offset / BLOCK_BYTES));
    const blockOffset = offset % BLOCK_BYTES;
    if (block === undefined || blockOffset < block.begin || blockOffset >= block.end) return null;
    return block.bytes.subarray(blockOffset, block.end);
  }

  #findOrAddBlock(number: number): Block {
    const existing = this.#blocks.get(number);
    if (existing !== undefined) return existing;
    const block = { bytes: new Uint8Array(BLOCK_BYTES), begin: BLOCK_BYTES, end: 0 };
    this.#blocks.set(number, block);
    const [oldest] = this.#blocks.keys();
    if (this.#blocks.size > MAX_BLOCKS && oldest !== undefined) this.#blocks.delete(oldest);
    return block;
  }
}

/** Resolve or reject like `promise`, or reject when the signal aborts first. */
export function unlessAborted<T>(promise: Promise<T>, signal: AbortSignal): Promise<T> {
  return new Promise((resolve, reject) => {
    const abort = (): void => reject(signal.reason as Error);
    signal.addEventListener("abort", abort, { once: true });
    promise.then(resolve, reject).finally(() => signal.removeEventListener("abort", abort));
  });
}
