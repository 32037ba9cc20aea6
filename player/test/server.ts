/** A server of one stream, with the features and faults of real servers. */

import { readFileSync } from "node:fs";
import { createServer, type IncomingMessage, type Server, type ServerResponse } from "node:http";
import type { AddressInfo } from "node:net";
import { fileURLToPath } from "node:url";

const PLAYER = fileURLToPath(new URL("../", import.meta.url));
const SUITE = new URL("../../conformance/", import.meta.url);
const PIECES_PER_SECOND = 50; // for a response of limited speed

/** A stream of the conformance suite. */
export const readVector = (path: string): Uint8Array => readFileSync(new URL(`${path}.quarc`, SUITE));

/** A file of player/. */
export const readPlayerFile = (path: string): Uint8Array => readFileSync(`${PLAYER}${path}`);

/** The stream for the browser tests (test/streams/make_room.py). */
export const readRoom = (): Uint8Array => readPlayerFile("test/streams/room.quarc");

export interface ServerOptions {
  /** Whether it answers range requests with 206; otherwise all responses are 200. */
  readonly ranges?: boolean;
  /** Break the connection after this number of bytes of every response. */
  readonly diesAfter?: number;
  /** Answer every request for the stream with this status. */
  readonly status?: number | null;
  /** Limit of the transfer rate. */
  readonly bitsPerSecond?: number;
  /** Other files, by path: "/" is the page. */
  readonly files?: Readonly<Record<string, Uint8Array | string>>;
}

const TYPES: Readonly<Record<string, string>> = {
  js: "text/javascript",
  mjs: "text/javascript",
  png: "image/png",
  wasm: "application/wasm",
};

export class StreamServer {
  /** The Range headers of the requests for the stream, in order. */
  readonly requests: string[] = [];
  readonly #server: Server;
  #stream: Uint8Array;
  #options: ServerOptions;

  private constructor(stream: Uint8Array, options: ServerOptions) {
    this.#stream = stream;
    this.#options = options;
    this.#server = createServer((request, response) => void this.#answer(request, response));
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

  /** Serve another stream from now on, as if one was being written. */
  grow(stream: Uint8Array): void {
    this.#stream = stream;
  }

  /** Change some of the options. */
  set(options: ServerOptions): void {
    this.#options = { ...this.#options, ...options };
  }

  async [Symbol.asyncDispose](): Promise<void> {
    this.#server.closeAllConnections();
    await new Promise((resolve) => this.#server.close(resolve));
  }

  async #answer(request: IncomingMessage, response: ServerResponse): Promise<void> {
    const path = (request.url ?? "").replace(/\?.*/, "");
    if (path === "/stream.quarc") await this.#answerStream(request, response);
    else this.#answerFile(path, response);
  }

  #answerFile(path: string, response: ServerResponse): void {
    const file = this.#options.files?.[path];
    const type = TYPES[path.split(".").at(-1) ?? ""] ?? "text/html; charset=utf-8";
    if (file === undefined) response.writeHead(path === "/favicon.ico" ? 204 : 404).end();
    else response.writeHead(200, { "Content-Type": type }).end(file);
  }

  async #answerStream(request: IncomingMessage, response: ServerResponse): Promise<void> {
    const { status = null, ranges = true, diesAfter = Infinity } = this.#options;
    const size = this.#stream.length;
    const asked = /^bytes=(\d+)-(\d*)$/.exec(request.headers.range ?? "");
    this.requests.push(request.headers.range ?? "");
    if (status !== null) {
      response.writeHead(status).end();
      return;
    }
    const isPart = ranges && asked !== null;
    const begin = isPart ? Number(asked[1]) : 0;
    if (begin >= size) {
      response.writeHead(416, { "Content-Range": `bytes */${size}` }).end();
      return;
    }
    const end = isPart && asked[2] !== "" ? Math.min(size, Number(asked[2]) + 1) : size;
    const body = this.#stream.subarray(begin, end);
    const range = { "Content-Range": `bytes ${begin}-${end - 1}/${size}` };
    response.writeHead(isPart ? 206 : 200, { "Content-Length": body.length, ...(isPart ? range : {}) });
    await this.#send(body.subarray(0, diesAfter), response);
    if (diesAfter < body.length) setTimeout(() => response.destroy(), 5);
    else response.end();
  }

  async #send(body: Uint8Array, response: ServerResponse): Promise<void> {
    const { bitsPerSecond = Infinity } = this.#options;
    const piece = Math.min(body.length, Math.ceil(bitsPerSecond / 8 / PIECES_PER_SECOND));
    const begun = performance.now();
    for (let sent = 0; sent < body.length && !response.destroyed; ) {
      response.write(body.subarray(sent, sent + piece));
      sent += piece;
      const due = begun + (8000 * sent) / bitsPerSecond;
      if (due > performance.now()) await new Promise((wake) => setTimeout(wake, due - performance.now()));
    }
  }
}
