/** Reads a stream from a server, with retries, and with range requests if the server supports them. */

import type { StreamSource } from "../protocol.js";

const MAX_RETRIES = 4; // consecutive failures without a received byte
const RETRY_PAUSE_MS = 100;
const LIVE_POLL_MS = 500;

/** A stream cannot be received. */
export class NetworkError extends Error {
  override readonly name = "NetworkError";
}

/** Bytes at an offset of a stream. */
export interface Piece {
  readonly offset: number;
  readonly bytes: Uint8Array;
}

export class HttpSource {
  /** Size of the stream in bytes, or the size so far of a live stream; null if unknown. */
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

  /** Read the bytes from an offset to the end of the stream; a live stream is read as it grows. */
  async *read(offset: number, signal: AbortSignal): AsyncGenerator<Piece, void, void> {
    let nextOffset = offset;
    for (let failures = 0; ; ) {
      try {
        for await (const piece of this.#readResponse(nextOffset, signal)) {
          nextOffset = piece.offset + piece.bytes.length;
          failures = 0;
          yield piece;
        }
        if (!this.isLive) return;
        await sleep(LIVE_POLL_MS, signal);
      } catch (error) {
        if (signal.aborted || error instanceof NetworkError) throw error;
        if (++failures > MAX_RETRIES) throw new NetworkError(`${this.#url}: ${String(error)}`);
        await sleep(RETRY_PAUSE_MS * 2 ** failures, signal);
      }
    }
  }

  /** Send a request, and read the bytes of its response from an offset onwards. */
  async *#readResponse(requestedOffset: number, signal: AbortSignal): AsyncGenerator<Piece, void, void> {
    const headers = { ...this.#headers, Range: `bytes=${requestedOffset}-` };
    const response = await fetch(this.#url, { headers, signal, cache: this.isLive ? "no-store" : "no-cache" });
    let offset = this.#findBodyOffset(response, requestedOffset);
    if (response.body === null || offset === null) return;
    const reader = response.body.getReader();
    try {
      for (;;) {
        const { done, value } = await reader.read();
        if (done) break;
        const skippedBytes = Math.min(value.length, Math.max(0, requestedOffset - offset));
        if (skippedBytes < value.length) yield { offset: offset + skippedBytes, bytes: value.subarray(skippedBytes) };
        offset += value.length;
      }
      // A complete response ends at the end of the stream.
      if (this.size !== null && offset < this.size) throw new TypeError("the response was truncated");
      this.size = offset;
    } finally {
      void reader.cancel().catch(() => undefined);
    }
  }

  /** Find the offset of a response's body; return null if the stream ends before `requestedOffset`. */
  #findBodyOffset(response: Response, requestedOffset: number): number | null {
    const { status, headers } = response;
    const length = headers.get("Content-Length");
    const range = headers.get("Content-Range"); // null also if a server on another origin does not expose it
    const rangeMatch = /^bytes (?:(\d+)-\d+|\*)\/(\d+)$/.exec(range ?? "");
    if (status === 416) {
      if (rangeMatch !== null) this.size = Number(rangeMatch[2]);
      void response.body?.cancel();
      return null;
    }
    if (status === 206 && (range === null || Number(rangeMatch?.[1]) === requestedOffset)) {
      this.hasRanges = true;
      if (rangeMatch !== null) this.size = Number(rangeMatch[2]);
      else if (length !== null) this.size = requestedOffset + Number(length);
      return requestedOffset;
    }
    if (status === 200) {
      if (length !== null && !headers.has("Content-Encoding")) this.size = Number(length);
      return 0;
    }
    void response.body?.cancel();
    if (status >= 500) throw new TypeError(`the server answered ${status}`); // is retried
    const answer = status === 206 ? "with a range that was not requested" : String(status);
    throw new NetworkError(`${this.#url}: the server answered ${answer}`);
  }
}

function sleep(milliseconds: number, signal: AbortSignal): Promise<void> {
  return new Promise((resolve, reject) => {
    const abort = (): void => {
      clearTimeout(timer);
      reject(signal.reason as Error);
    };
    const timer = setTimeout(() => {
      signal.removeEventListener("abort", abort);
      resolve();
    }, milliseconds);
    if (signal.aborted) abort();
    else signal.addEventListener("abort", abort, { once: true });
  });
}
