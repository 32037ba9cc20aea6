/**
 * The decode worker without the worker: handles requests and posts frames within the allowed number.
 *
 * Needs neither a page nor a worker, so programs can use it directly.
 */

import type { DecodeReply, DecodeRequest } from "../protocol.js";
import { describe } from "./fault.js";
import { OpenStream } from "./open-stream.js";
import { Quarc } from "./quarc.js";
import { Run } from "./run.js";

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
    if (request.kind === "open") this.#stream = new OpenStream(request.source, request.isIndexFirst === true);
    if (this.#stream === null) return;
    const run = new Run(request.run, this.#stream, this.#post);
    this.#run = run;
    // The previous run must end first: both use the memory of one module.
    this.#done = this.#done.then(() => this.#play(run, request));
  }

  async #play(run: Run, request: Extract<DecodeRequest, { kind: "open" | "seek" }>): Promise<void> {
    if (run.isAborted) return;
    try {
      this.#quarc ??= Quarc.load();
      const quarc = await this.#quarc;
      if (request.kind === "open") await run.play(quarc, 0);
      else await run.play(quarc, request.frame, request.orLast);
    } catch (error) {
      if (!isUsable(error)) this.#quarc = null;
      if (run.isAborted) return;
      const frame = run.frame === null ? null : run.frame + 1;
      this.#post({ kind: "error", error: describe(error, frame), run: run.number }, []);
    }
  }
}

/** Whether the module can still be used after an error: not after a trap, nor if it failed to load. */
function isUsable(error: unknown): boolean {
  return !(error instanceof WebAssembly.RuntimeError || error instanceof WebAssembly.CompileError);
}
