/** Many jobs in one process: lines of JSON on standard input, each optionally followed by the bytes of a stream. */

import { answerRecovery, answerSeek, answerStream } from "./answers.js";
import type { Line } from "./answers.js";
import { FileSource, MemorySource, readSome } from "./source.js";
import { answerUnit, UNITS } from "./units.js";

export const CAPABILITIES = {
  capabilities: ["jobs", "seek", "recover", "grow", "numbers", "metadata", "updates", "snapshots"],
  units: Object.keys(UNITS),
};

interface Job {
  readonly job: string;
  readonly bytes?: number;
  readonly start?: number;
  readonly numbers?: boolean;
  readonly function?: string;
  readonly input?: unknown;
}

/** Answer all jobs of a file or a pipe. */
export function* answerJobs(descriptor: number): Generator<Line, void, undefined> {
  const input = new JobInput(descriptor);
  for (let line = input.readLine(); line !== null; line = input.readLine()) {
    const job = JSON.parse(line) as Job;
    const stream = input.read(job.bytes ?? 0);
    if (job.job === "unit") yield answerUnit(job.function ?? "", job.input);
    else if (job.job === "recover") yield* answerRecovery(stream);
    else if (job.start !== undefined) yield* answerSeek(stream, job.start, job.numbers === true);
    else yield* answerStream(new MemorySource(stream), job.numbers === true);
    yield { done: true };
  }
}

const PIECE_BYTES = 1 << 16;
const NEWLINE = 10;

/** Reads a mix of lines and bytes. */
class JobInput {
  #pending: Uint8Array = new Uint8Array(0);

  readonly #source: FileSource;

  constructor(descriptor: number) {
    this.#source = new FileSource(descriptor);
  }

  /** The next line without its terminator, or null at the end. */
  readLine(): string | null {
    let end = this.#pending.indexOf(NEWLINE);
    while (end < 0) {
      if (!this.#fill()) return null;
      end = this.#pending.indexOf(NEWLINE);
    }
    const line = Buffer.from(this.#take(end)).toString("utf8");
    this.#take(1);
    return line;
  }

  read(count: number): Uint8Array {
    const first = this.#take(count);
    return Buffer.concat([first, this.#source.read(count - first.length)]);
  }

  #take(count: number): Uint8Array {
    const taken = this.#pending.subarray(0, count);
    this.#pending = this.#pending.subarray(count);
    return taken;
  }

  #fill(): boolean {
    const piece = Buffer.allocUnsafe(PIECE_BYTES);
    const count = readSome(this.#source.descriptor, piece);
    this.#pending = Buffer.concat([this.#pending, piece.subarray(0, count)]);
    return count > 0;
  }
}
