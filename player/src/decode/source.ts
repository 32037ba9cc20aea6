/** Reads a stream from a server, with retries, and with range requests if the server supports them. */

import type { StreamSource } from "../protocol.js";

const MAX_RETRIES = 4; // consecutive failures without a received byte or a complete response
const MAX_LIVE_RETRIES = 20; // of a live stream that has been received before: about a minute
const RETRY_PAUSE_MS = 100;
const MAX_RETRY_PAUSE_MS = 3200;
const STALL_MS = 15_000; // without a byte, after which a connection counts as broken
const LIVE_POLL_MS = 500;
const TEMPORARY_STATUSES = [408, 425, 429]; // Request Timeout, Too Early, Too Many Requests

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
  #compresses = false; // also the answers to range requests
  #validators: readonly (string | null | undefined)[] = []; // ETag, if it is strong, and Last-Modified

  constructor(source: Extract<StreamSource, { url: string }>) {
    this.#url = source.url;
    this.#headers = source.headers ?? {};
    this.isLive = source.isLive === true;
  }

  /** Read the bytes from an offset to the end of the stream; a live stream is read as it grows. */
  async *read(offset: number, signal: AbortSignal): AsyncGenerator<Piece, void, void> {
    if (!isAddress(this.#url)) this.#fail("the address is invalid"); // which `fetch` reports like a broken connection
    let nextOffset = offset;
    for (let failures = 0; ; ) {
      try {
        const firstOffset = nextOffset;
        for await (const piece of this.#readResponse(nextOffset, signal)) {
          nextOffset = piece.offset + piece.bytes.length;
          failures = 0;
          yield piece;
        }
        failures = 0; // the current end of a live stream has no bytes
        if (this.isLive) await sleep(LIVE_POLL_MS, signal);
        else if (this.size !== null || nextOffset === firstOffset) return;
      } catch (error) {
        if (signal.aborted || error instanceof NetworkError) throw error;
        const maxRetries = this.isLive && this.size !== null ? MAX_LIVE_RETRIES : MAX_RETRIES;
        if (++failures > maxRetries) this.#fail(describeFailure(error));
        await sleep(Math.min(MAX_RETRY_PAUSE_MS, RETRY_PAUSE_MS * 2 ** failures), signal);
      }
    }
  }

  /** Send a request, and read the bytes of its response from an offset onwards. */
  async *#readResponse(requestedOffset: number, signal: AbortSignal): AsyncGenerator<Piece, void, void> {
    const request = new AbortController();
    const abort = (): void => request.abort(signal.reason);
    signal.throwIfAborted();
    signal.addEventListener("abort", abort);
    try {
      const response = await this.#unlessStalled(this.#fetch(requestedOffset, request.signal), request);
      let offset = this.#findBodyOffset(response, requestedOffset);
      const reader = response.body?.getReader();
      if (reader === undefined || offset === null) return;
      for (;;) {
        const { done, value } = await this.#unlessStalled(reader.read(), request, offset);
        if (done) break;
        const skippedBytes = Math.min(value.length, Math.max(0, requestedOffset - offset));
        if (skippedBytes < value.length) yield { offset: offset + skippedBytes, bytes: value.subarray(skippedBytes) };
        offset += value.length;
      }
      if (this.size !== null && offset < this.size) throw new TypeError("the response was truncated");
      // A complete response ends at the end of the stream, unless it is a part of a stream of unknown size.
      if (this.isLive || !response.headers.get("Content-Range")?.endsWith("*")) this.size = offset;
    } finally {
      signal.removeEventListener("abort", abort);
      request.abort();
    }
  }

  /**
   * Send a request for the bytes from an offset onwards. Some servers compress also the answers to range requests, which
   * browsers reject as if the server was unreachable. A server that then answers only without a range is such a server.
   */
  async #fetch(offset: number, signal: AbortSignal): Promise<Response> {
    const send = (range: Readonly<Record<string, string>>): Promise<Response> =>
      fetch(this.#url, { headers: { ...this.#headers, ...range }, signal, cache: this.isLive ? "no-store" : "no-cache" });
    const sendRange = (): Promise<Response> => send({ Range: `bytes=${offset}-` });
    if (this.#compresses) return send({});
    try {
      return await sendRange();
    } catch (error) {
      if (this.hasRanges) throw error;
    }
    const whole = await send({});
    try {
      const part = await sendRange(); // the server was only unreachable for a moment
      void whole.body?.cancel();
      return part;
    } catch {
      this.#compresses = whole.ok && !signal.aborted;
      return whole;
    }
  }

  /**
   * Resolve or reject like a step of a request, but abort the request if it stalls. A live stream may wait for bytes at
   * its end as long as it likes.
   */
  #unlessStalled<T>(step: Promise<T>, request: AbortController, offset = Infinity): Promise<T> {
    if (this.isLive && offset >= (this.size ?? 0)) return step;
    const stall = new TypeError(`no byte arrived for ${STALL_MS / 1000} s`);
    const timer = setTimeout(() => request.abort(stall), STALL_MS);
    return step.finally(() => clearTimeout(timer));
  }

  /** Find the offset of a response's body; return null if the stream ends before `requestedOffset`. */
  #findBodyOffset({ status, headers }: Response, requestedOffset: number): number | null {
    const range = headers.get("Content-Range"); // null also if a server on another origin does not expose it
    const [, begin, total] = /^bytes (?:(\d+)-\d+|\*)\/(\d+|\*)$/.exec(range ?? "") ?? [];
    const isPart = status === 206;
    if (status >= 500 || TEMPORARY_STATUSES.includes(status)) throw new TypeError(`the server answered ${status}`); // is retried
    if (isPart ? range !== null && Number(begin) !== requestedOffset : status !== 200 && status !== 416) {
      this.#fail(`the server answered ${isPart ? "with a range that was not requested" : status}`);
    }
    const bodyOffset = status === 200 ? 0 : requestedOffset;
    // A server on another origin does not expose the header Content-Encoding.
    const isEncoded = this.#compresses || headers.has("Content-Encoding");
    const hasLength = status !== 416 && total === undefined && !isEncoded;
    const size = hasLength ? bodyOffset + Number(headers.get("Content-Length") ?? NaN) : Number(total); // NaN: unknown
    if (this.#hasChanged(headers, size)) this.#fail("the file on the server has changed");
    if (size >= 0) this.size = size;
    this.hasRanges ||= isPart;
    return status === 416 ? null : bodyOffset;
  }

  /**
   * Whether a response is from another version of the file than the responses before it. A live stream may grow, and
   * its validators change with its size.
   */
  #hasChanged(headers: Headers, size: number): boolean {
    const knownSize = this.size ?? NaN;
    if (this.isLive) return size < knownSize;
    const etag = headers.get("ETag");
    const validators = [etag?.startsWith("W/") ? null : etag, headers.get("Last-Modified")];
    const comparable = validators.findIndex((validator, index) => validator && this.#validators[index]);
    const hasOtherValidator = validators[comparable] !== this.#validators[comparable];
    this.#validators = validators.map((validator, index) => this.#validators[index] ?? validator);
    return size < knownSize || size > knownSize || hasOtherValidator;
  }

  #fail(message: string): never {
    const name = this.#url.startsWith("data:") ? "the stream in the page" : this.#url;
    throw new NetworkError(`${name}: ${message}`);
  }
}

/** Describe why a request has failed, which Node tells only in the error's cause. */
function describeFailure(error: unknown): string {
  const { cause } = error as { cause?: { message: string; code?: string } };
  return cause === undefined ? String(error) : `${String(error)}: ${cause.message || cause.code}`;
}

function isAddress(url: string): boolean {
  try {
    return new URL(url).protocol !== "";
  } catch {
    return false;
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
