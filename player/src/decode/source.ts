/** Where the bytes of a stream come from: a server, by ranges where it gives them, or memory. */

import type { StreamSource } from "../protocol.js";

const PIECE_BYTES = 1 << 16;
const RETRIES = 4; // without a byte in between
const FIRST_PAUSE_MS = 100;
const LIVE_PAUSE_MS = 500;

/** The way to a stream is broken; nothing is said of the stream. */
export class NetworkError extends Error {
  override readonly name = "NetworkError";
}

/** Bytes that stand at a place of a stream. */
export interface Piece {
  readonly offset: number;
  readonly bytes: Uint8Array;
}

export interface ByteSource {
  /** Bytes of the stream, where that is known. */
  readonly size: number | null;
  /** Whether any place can be read without what lies before it. */
  readonly hasRanges: boolean;
  readonly isLive: boolean;
  /** The bytes from a place on, up to the end of the stream. */
  read(offset: number, signal: AbortSignal): AsyncGenerator<Piece, void, void>;
}

export function makeSource(source: StreamSource): ByteSource {
  return "bytes" in source ? new BytesSource(new Uint8Array(source.bytes)) : new HttpSource(source);
}

class BytesSource implements ByteSource {
  readonly hasRanges = true;
  readonly isLive = false;
  readonly #bytes: Uint8Array;

  constructor(bytes: Uint8Array) {
    this.#bytes = bytes;
  }

  get size(): number {
    return this.#bytes.length;
  }

  async *read(offset: number): AsyncGenerator<Piece, void, void> {
    for (let place = offset; place < this.size; place += PIECE_BYTES) {
      yield { offset: place, bytes: this.#bytes.subarray(place, place + PIECE_BYTES) };
    }
  }
}

class HttpSource implements ByteSource {
  size: number | null = null;
  hasRanges = false;
  readonly isLive: boolean;
  readonly #url: string;
  readonly #headers: Readonly<Record<string, string>>;

  constructor(source: Extract<StreamSource, { url: string }>) {
    this.#url = source.url;
    this.#headers = source.headers ?? {};
    this.isLive = source.isLive === true;
  }

  async *read(offset: number, signal: AbortSignal): AsyncGenerator<Piece, void, void> {
    let place = offset;
    for (let failures = 0; ; ) {
      try {
        for await (const piece of this.#request(place, signal)) {
          place = piece.offset + piece.bytes.length;
          failures = 0;
          yield piece;
        }
        if (!this.isLive) return;
        await pause(LIVE_PAUSE_MS, signal);
      } catch (error) {
        if (signal.aborted || error instanceof NetworkError) throw error;
        if (++failures > RETRIES) throw new NetworkError(`${this.#url}: ${String(error)}`);
        await pause(FIRST_PAUSE_MS * 2 ** failures, signal);
      }
    }
  }

  /** The bytes of one answer from a place on. */
  async *#request(place: number, signal: AbortSignal): AsyncGenerator<Piece, void, void> {
    const headers = { ...this.#headers, Range: `bytes=${place}-` };
    const response = await fetch(this.#url, { headers, signal, cache: "no-store" });
    let offset = this.#begin(response, place);
    if (response.body === null || offset === null) return;
    const reader = response.body.getReader();
    try {
      for (;;) {
        const { done, value } = await reader.read();
        if (done) break;
        const passed = Math.min(value.length, Math.max(0, place - offset));
        if (passed < value.length) yield { offset: offset + passed, bytes: value.subarray(passed) };
        offset += value.length;
      }
      // An answer that is whole ends where the stream does.
      if (this.size !== null && offset < this.size) throw new TypeError("the answer is cut");
      if (!this.isLive) this.size = offset;
    } finally {
      void reader.cancel().catch(() => undefined);
    }
  }

  /** Where the body of an answer begins; null where the stream has nothing there (yet). */
  #begin(response: Response, place: number): number | null {
    const { status, headers } = response;
    const range = /^bytes (?:(\d+)-\d+|\*)\/(\d+)$/.exec(headers.get("Content-Range") ?? "");
    if (status === 416) {
      this.#learnSize(range === null ? null : Number(range[2]));
      void response.body?.cancel();
      return null;
    }
    if (status === 206 && range !== null && Number(range[1]) === place) {
      this.hasRanges = true;
      this.#learnSize(Number(range[2]));
      return place;
    }
    if (status === 200) {
      const length = headers.get("Content-Length");
      const isCoded = headers.has("Content-Encoding");
      this.#learnSize(length === null || isCoded ? null : Number(length));
      return 0;
    }
    void response.body?.cancel();
    if (status >= 500) throw new TypeError(`the server answered ${status}`); // it may recover
    const said = status === 206 ? "another range than that which was asked for" : String(status);
    throw new NetworkError(`${this.#url}: the server answered ${said}`);
  }

  #learnSize(size: number | null): void {
    if (size !== null) this.size = size;
  }
}

function pause(milliseconds: number, signal: AbortSignal): Promise<void> {
  return new Promise((resolve, reject) => {
    const stop = (): void => {
      clearTimeout(timer);
      reject(signal.reason as Error);
    };
    const timer = setTimeout(() => {
      signal.removeEventListener("abort", stop);
      resolve();
    }, milliseconds);
    if (signal.aborted) stop();
    else signal.addEventListener("abort", stop, { once: true });
  });
}
