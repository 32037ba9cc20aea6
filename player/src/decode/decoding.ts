/**
 * The decode worker without the worker: takes requests and posts frames as they are allowed.
 *
 * Needs neither a page nor a worker, so programs can run it directly.
 */

import type { DecodeReply, DecodeRequest } from "../protocol.js";
import { describe } from "./fault.js";
import { Quarc } from "./quarc.js";
import { Run, type OpenStream } from "./run.js";
import { makeStreamBytes } from "./stream-bytes.js";

export type Post = (reply: DecodeReply, transferred: ArrayBuffer[]) => void;

export class Decoding {
  readonly #post: Post;
  #run: Run | null = null;
  #stream: OpenStream | null = null;
  #quarc: Promise<Quarc> | null = null;
  #done: Promise<void> = Promise.resolve();

  constructor(post: Post) {
    this.#post = post;
  }

  /** Handle a request of the page. */
  take(request: DecodeRequest): void {
    if (request.kind === "more") {
      if (this.#run?.number === request.run) this.#run.allow(request.frames);
      return;
    }
    this.#run?.abort();
    this.#run = null;
    if (request.kind !== "seek") this.#stream?.bytes.close();
    if (request.kind === "close") return;
    if (request.kind === "open") {
      const bytes = makeStreamBytes(request.source);
      this.#stream = {
        ...{ bytes, index: null, firstFrame: null, isIndexSought: false },
        isIndexFirst: request.isIndexFirst === true,
      };
    }
    if (this.#stream === null) return;
    const run = new Run(request.run, this.#stream, this.#post);
    this.#run = run;
    // The run before ends first: both use the memory of one module.
    this.#done = this.#done.then(() => this.#play(run, request.kind === "open" ? 0 : request.frame));
  }

  async #play(run: Run, start: number): Promise<void> {
    if (run.isAborted) return;
    try {
      this.#quarc ??= Quarc.load();
      await run.play(await this.#quarc, start);
    } catch (error) {
      if (!isUsable(error)) this.#quarc = null;
      if (run.isAborted) return;
      const frame = run.frame === null ? null : run.frame + 1;
      this.#post({ kind: "error", error: describe(error, frame), run: run.number }, []);
    }
  }
}

/** Whether the module can still be used after an error: not after a trap, nor if it did not load. */
function isUsable(error: unknown): boolean {
  return !(error instanceof WebAssembly.RuntimeError || error instanceof WebAssembly.CompileError);
}
