/** A stream on a server, by range requests if the server supports them, with retries. */

import type { StreamSource } from "../protocol.js";

const RETRIES = 4; // in a row, without receiving a byte
const FIRST_PAUSE_MS = 100;
const LIVE_PAUSE_MS = 500;

/** The stream cannot be received; this says nothing about its contents. */
export class NetworkError extends Error {
  override readonly name = "NetworkError";
}

/** Bytes at an offset of a stream. */
export interface Piece {
  readonly offset: number;
  readonly bytes: Uint8Array;
}

export class HttpSource {
  /** Size of the stream in bytes, once known; for a live stream, its size so far. */
  size: number | null = null;
  /** Whether the server supports range requests. */
  hasRanges = false;
  readonly isLive: boolean;
  readonly #url: string;
  readonly #headers: Readonly<Record<string, string>>;

  constructor(source: Extract<StreamSource, { url: string }>) {
    this.#url = source.url;
    this.#headers = source.headers ?? {};
    this.isLive = source.isLive === true;
  }

  /**
   * The bytes from an offset to the end of the stream; for a live stream, including those written later.
   */
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

  /** The bytes of one response from an offset on. */
  async *#request(place: number, signal: AbortSignal): AsyncGenerator<Piece, void, void> {
    const headers = { ...this.#headers, Range: `bytes=${place}-` };
    const response = await fetch(this.#url, { headers, signal, cache: this.isLive ? "no-store" : "no-cache" });
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
      // A complete response ends at the end of the stream.
      if (this.size !== null && offset < this.size) throw new TypeError("the response was truncated");
      this.size = offset;
    } finally {
      void reader.cancel().catch(() => undefined);
    }
  }

  /** The offset of a response's body; null if the stream has no bytes there (yet). */
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
      const isCompressed = headers.has("Content-Encoding");
      this.#learnSize(length === null || isCompressed ? null : Number(length));
      return 0;
    }
    void response.body?.cancel();
    if (status >= 500) throw new TypeError(`the server answered ${status}`); // it may recover
    const answer = status === 206 ? "with another range than was requested" : String(status);
    throw new NetworkError(`${this.#url}: the server answered ${answer}`);
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
