/** A test server for one stream, with the features and faults of real servers. */

import { readFileSync } from "node:fs";
import { createServer, type IncomingMessage, type Server, type ServerResponse } from "node:http";
import type { AddressInfo } from "node:net";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";

const PLAYER_FOLDER = fileURLToPath(new URL("../", import.meta.url));
const CONFORMANCE_FOLDER = new URL("../../conformance/", import.meta.url);
const PIECES_PER_SECOND = 50; // of a response whose transfer rate is limited

/** Read a stream of the conformance suite. */
export const readVector = (path: string): Uint8Array => readFileSync(new URL(`${path}.quarc`, CONFORMANCE_FOLDER));

/** Read a file of player/. */
export const readPlayerFile = (path: string): Uint8Array => readFileSync(`${PLAYER_FOLDER}${path}`);

/** Read the stream of the browser tests, which test/streams/make_room.py has written. */
export const readRoom = (): Uint8Array => readPlayerFile("test/streams/room.quarc");

export interface ServerOptions {
  /** Whether the server answers range requests with status 206; otherwise it answers all requests with 200. */
  readonly supportsRanges?: boolean;
  /** Other headers of each response, such as ETag. */
  readonly headers?: Readonly<Record<string, string>>;
  /** Maximum number of bytes of each part, if the server does not tell the size of the stream. */
  readonly unknownSizePartBytes?: number | null;
  /** Number of bytes of each response after which the server breaks the connection. */
  readonly breakAfterBytes?: number;
  /** Number of bytes of each response after which the server sends nothing more, but keeps the connection open. */
  readonly stallAfterBytes?: number;
  /** Status with which the server answers every request for the stream; null for normal answers. */
  readonly status?: number | null;
  /** Whether pages of other origins may request the stream. */
  readonly allowsOrigins?: boolean;
  /** Whether the server sends the whole stream, compressed with gzip, to clients that do not accept it. */
  readonly compresses?: boolean;
  /** Maximum transfer rate of the stream. */
  readonly bitsPerSecond?: number;
  /** Offset in the stream from which no bytes are sent until the test changes this option. */
  readonly heldFrom?: number;
  /** Other files by path; "/" is the page. */
  readonly files?: Readonly<Record<string, Uint8Array | string>>;
}

const CONTENT_TYPES: Readonly<Record<string, string>> = {
  js: "text/javascript",
  mjs: "text/javascript",
  png: "image/png",
  wasm: "application/wasm",
};

export class StreamServer {
  /** Range headers of the requests for the stream, in order; "" for a request without a range. */
  readonly requests: string[] = [];
  readonly #server: Server;
  #stream: Uint8Array;
  #options: ServerOptions;

  private constructor(stream: Uint8Array, options: ServerOptions) {
    this.#stream = stream;
    this.#options = options;
    this.#server = createServer((request, response) => void this.#respond(request, response));
  }

  static async start(stream: Uint8Array, options: ServerOptions = {}): Promise<StreamServer> {
    const server = new StreamServer(stream, options);
    await new Promise<void>((resolve) => server.#server.listen(0, "127.0.0.1", resolve));
    return server;
  }

  get origin(): string {
    return `http://127.0.0.1:${(this.#server.address() as AddressInfo).port}`;
  }

  get url(): string {
    return `${this.origin}/stream.quarc`;
  }

  /** Replace the stream, usually by a longer stream, as if it was being written. */
  grow(stream: Uint8Array): void {
    this.#stream = stream;
  }

  /** Change some of the options. */
  setOptions(options: ServerOptions): void {
    this.#options = { ...this.#options, ...options };
  }

  /** Break all connections, such as those whose bytes are held. */
  breakConnections(): void {
    this.#server.closeAllConnections();
  }

  async [Symbol.asyncDispose](): Promise<void> {
    this.breakConnections();
    await new Promise((resolve) => this.#server.close(resolve));
  }

  async #respond(request: IncomingMessage, response: ServerResponse): Promise<void> {
    const path = (request.url ?? "").replace(/\?.*/, "");
    if (path === "/stream.quarc") await this.#respondWithStream(request, response);
    else this.#respondWithFile(path, request, response);
  }

  #respondWithFile(path: string, request: IncomingMessage, response: ServerResponse): void {
    const file = this.#options.files?.[path];
    if (path.endsWith(".wav") && file !== undefined) return this.#respondWithAudio(Buffer.from(file), request, response);
    const type = CONTENT_TYPES[path.split(".").at(-1) ?? ""] ?? "text/html; charset=utf-8";
    if (file === undefined) response.writeHead(path === "/favicon.ico" ? 204 : 404).end();
    else response.writeHead(200, { "Content-Type": type }).end(file);
  }

  /** Browsers seek in audio only if the server supports ranges. */
  #respondWithAudio(file: Buffer, request: IncomingMessage, response: ServerResponse): void {
    const rangeMatch = /^bytes=(\d+)-(\d*)$/.exec(request.headers.range ?? "");
    response.setHeader("Content-Type", "audio/wav");
    if (rangeMatch === null || this.#options.supportsRanges === false) return void response.writeHead(200).end(file);
    const [begin, last] = [Number(rangeMatch[1]), Number(rangeMatch[2] || file.length - 1)];
    response.writeHead(206, { "Content-Range": `bytes ${begin}-${last}/${file.length}` }).end(file.subarray(begin, last + 1));
  }

  async #respondWithStream(request: IncomingMessage, response: ServerResponse): Promise<void> {
    const { status = null, supportsRanges = true, unknownSizePartBytes = null } = this.#options;
    const { breakAfterBytes = Infinity, stallAfterBytes = Infinity } = this.#options;
    const size = this.#stream.length;
    const rangeMatch = /^bytes=(\d+)-(\d*)$/.exec(request.headers.range ?? "");
    this.requests.push(request.headers.range ?? "");
    if (this.#options.allowsOrigins === true) response.setHeader("Access-Control-Allow-Origin", "*");
    for (const [name, value] of Object.entries(this.#options.headers ?? {})) response.setHeader(name, value);
    if (status !== null) {
      response.writeHead(status).end();
      return;
    }
    if (this.#options.compresses === true) {
      const body = gzipSync(this.#stream);
      response.writeHead(200, { "Content-Encoding": "gzip", "Content-Length": body.length }).end(body);
      return;
    }
    const isPartial = supportsRanges && rangeMatch !== null;
    const begin = isPartial ? Number(rangeMatch[1]) : 0;
    if (begin >= size) {
      response.writeHead(416, { "Content-Range": `bytes */${size}` }).end();
      return;
    }
    const requestedEnd = isPartial && rangeMatch[2] !== "" ? Number(rangeMatch[2]) + 1 : size;
    const end = Math.min(size, requestedEnd, begin + (unknownSizePartBytes ?? size));
    const body = this.#stream.subarray(begin, end);
    const range = { "Content-Range": `bytes ${begin}-${end - 1}/${unknownSizePartBytes === null ? size : "*"}` };
    response.writeHead(isPartial ? 206 : 200, { "Content-Length": body.length, ...(isPartial ? range : {}) });
    await this.#send(body.subarray(0, Math.min(breakAfterBytes, stallAfterBytes)), begin, response);
    if (stallAfterBytes < body.length) return;
    if (breakAfterBytes < body.length) setTimeout(() => response.destroy(), 5);
    else response.end();
  }

  async #send(body: Uint8Array, begin: number, response: ServerResponse): Promise<void> {
    let dueTime = performance.now();
    for (let sentBytes = 0; sentBytes < body.length && !response.destroyed; ) {
      const { bitsPerSecond = Infinity, heldFrom = Infinity } = this.#options; // a test may change them meanwhile
      const sendableBytes = Math.min(body.length, heldFrom - begin) - sentBytes;
      const pieceBytes = Math.max(0, Math.min(sendableBytes, Math.ceil(bitsPerSecond / 8 / PIECES_PER_SECOND)));
      if (pieceBytes === 0) dueTime = performance.now() + 1000 / PIECES_PER_SECOND;
      response.write(body.subarray(sentBytes, sentBytes + pieceBytes));
      sentBytes += pieceBytes;
      dueTime += (8000 * pieceBytes) / bitsPerSecond;
      if (dueTime > performance.now()) await new Promise((resolve) => setTimeout(resolve, dueTime - performance.now()));
    }
  }
}
