/**
 * Handles decode requests and posts as many frames as the requests allow.
 *
 * The service runs in the decode worker, but needs neither a worker nor a page, so programs can also use it directly.
 */

import type { DecodeRequest, PostReply } from "../protocol.js";
import { describeError } from "./fault.js";
import { OpenStream } from "./open-stream.js";
import { ModuleError, QuarcModule } from "./quarc.js";
import { Run } from "./run.js";

export class DecodeService {
  readonly #post: PostReply;
  #run: Run | null = null;
  #stream: OpenStream | null = null;
  #quarc: Promise<QuarcModule> | null = null;
  #runsDone: Promise<void> = Promise.resolve();

  constructor(post: PostReply) {
    this.#post = post;
  }

  /** Handle a request of the page. */
  handle(request: DecodeRequest): void {
    if (request.kind === "more") {
      if (this.#run?.runNumber === request.run) this.#run.allow(request.frames);
      return;
    }
    this.#run?.abort();
    this.#run = null;
    if (request.kind !== "seek") this.#stream?.bytes.close();
    if (request.kind === "close") return;
    if (request.kind === "open") this.#stream = new OpenStream(request.source, request.readsIndexFirst === true);
    if (this.#stream === null) return;
    const run = new Run(request.run, this.#stream, this.#post);
    this.#run = run;
    // The previous run must end first: both use the memory of one module.
    this.#runsDone = this.#runsDone.then(() => this.#playRun(run, request));
  }

  async #playRun(run: Run, request: Extract<DecodeRequest, { kind: "open" | "seek" }>): Promise<void> {
    if (run.isAborted) return;
    try {
      this.#quarc ??= QuarcModule.load();
      const quarc = await this.#quarc;
      if (request.kind === "open") await run.play(quarc, 0);
      else await run.play(quarc, request.frame, request.clampToLast);
    } catch (error) {
      if (!isModuleUsable(error)) this.#quarc = null;
      if (run.isAborted) return;
      const frame = run.frame === null ? null : run.frame + 1;
      this.#post({ kind: "error", error: describeError(error, frame), run: run.runNumber }, []);
    }
  }
}

/** Whether the module can be used after an error: not if it has trapped or could not be loaded. */
function isModuleUsable(error: unknown): boolean {
  return !(error instanceof ModuleError || error instanceof WebAssembly.RuntimeError); // WebAssembly may be missing
}
