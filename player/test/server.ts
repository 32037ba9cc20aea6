/** A server of one stream, with the manners and the faults that servers have. */

import { readFileSync } from "node:fs";
import { createServer, type IncomingMessage, type Server, type ServerResponse } from "node:http";
import type { AddressInfo } from "node:net";

const SUITE = new URL("../../conformance/", import.meta.url);

export const readVector = (path: string): Uint8Array => readFileSync(new URL(`${path}.quarc`, SUITE));

export interface Manners {
  /** Whether it answers ranges. */
  readonly ranges?: boolean;
  /** It hangs up after so many bytes, each time it answers. */
  readonly diesAfter?: number;
  readonly status?: number;
}

export class StreamServer {
  readonly requests: string[] = [];
  readonly #server: Server;
  #stream: Uint8Array;
  #manners: Manners;

  private constructor(stream: Uint8Array, manners: Manners) {
    this.#stream = stream;
    this.#manners = manners;
    this.#server = createServer((request, response) => this.#answer(request, response));
  }

  static async start(stream: Uint8Array, manners: Manners = {}): Promise<StreamServer> {
    const made = new StreamServer(stream, { ranges: true, ...manners });
    await new Promise<void>((resolve) => made.#server.listen(0, "127.0.0.1", resolve));
    return made;
  }

  get url(): string {
    const { port } = this.#server.address() as AddressInfo;
    return `http://127.0.0.1:${port}/stream.quarc`;
  }

  /** Let the stream be another, as one that is being written. */
  grow(stream: Uint8Array): void {
    this.#stream = stream;
  }

  async [Symbol.asyncDispose](): Promise<void> {
    this.#server.closeAllConnections();
    await new Promise((resolve) => this.#server.close(resolve));
  }

  #answer(request: IncomingMessage, response: ServerResponse): void {
    const { status, ranges, diesAfter } = this.#manners;
    const size = this.#stream.length;
    const asked = /^bytes=(\d+)-$/.exec(request.headers.range ?? "");
    this.requests.push(request.headers.range ?? "");
    if (status !== undefined) {
      response.writeHead(status).end();
      return;
    }
    const begin = ranges === true && asked !== null ? Number(asked[1]) : 0;
    if (begin >= size) {
      response.writeHead(416, { "Content-Range": `bytes */${size}` }).end();
      return;
    }
    const body = this.#stream.subarray(begin);
    const range = { "Content-Range": `bytes ${begin}-${size - 1}/${size}` };
    const isPart = ranges === true && asked !== null;
    response.writeHead(isPart ? 206 : 200, { "Content-Length": body.length, ...(isPart ? range : {}) });
    if (diesAfter === undefined || diesAfter >= body.length) response.end(body);
    else response.write(body.subarray(0, diesAfter), () => setTimeout(() => response.destroy(), 5));
  }
}
