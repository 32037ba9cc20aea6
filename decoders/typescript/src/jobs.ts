/** Runs jobs from standard input: lines of JSON, each optionally followed by the bytes of a stream. */

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

/** The input is not a job: a fault of the sender, which says nothing about a stream. */
export class MalformedJob extends Error {
  constructor(message: string) {
    super(message);
    this.name = "MalformedJob";
  }
}

/**
 * Generate the output lines of all jobs in a file or pipe.
 *
 * @throws MalformedJob if a line is not a job, or if the input ends within a stream
 */
export function* answerJobs(descriptor: number): Generator<Line, void, undefined> {
  const input = new JobInput(descriptor);
  for (let line = input.readLine(); line !== null; line = input.readLine()) {
    const job = parseJob(line);
    const count = job.bytes ?? 0;
    const stream = input.read(count);
    if (stream.length < count) throw new MalformedJob("the input ends within the stream of a job");
    yield* answerJob(job, stream);
    yield { done: true };
  }
}

function parseJob(line: string): Job {
  let job: unknown;
  try {
    job = JSON.parse(line);
  } catch {
    job = null;
  }
  if (!isJob(job)) throw new MalformedJob(`not a job: ${line.slice(0, 60)}`);
  return job;
}

/** Whether a value has the key `job`, and only counts as `bytes` and `start`. */
function isJob(value: unknown): value is Job {
  if (typeof value !== "object" || value === null) return false;
  const { job, bytes, start } = value as Record<string, unknown>;
  return typeof job === "string" && isCount(bytes ?? 0) && isCount(start ?? 0);
}

function isCount(value: unknown): boolean {
  return Number.isSafeInteger(value) && (value as number) >= 0;
}

function* answerJob(job: Job, stream: Uint8Array): Generator<Line, void, undefined> {
  const hasNumbers = job.numbers === true;
  if (job.job === "unit") yield answerUnit(job.function ?? "", job.input);
  else if (job.job === "recover") yield* answerRecovery(stream);
  else if (job.job !== "decode") yield { unsupported: job.job };
  else if (job.start !== undefined) yield* answerSeek(stream, job.start, hasNumbers);
  else yield* answerStream(new MemorySource(stream), hasNumbers);
}

const PIECE_BYTES = 1 << 16;
const NEWLINE = 10;

/** Reads lines and bytes in any order. */
class JobInput {
  #buffer: Uint8Array = new Uint8Array(0);

  readonly #source: FileSource;

  constructor(descriptor: number) {
    this.#source = new FileSource(descriptor);
  }

  /** Read the next line, without its terminator; return null at the end. */
  readLine(): string | null {
    let end = this.#buffer.indexOf(NEWLINE);
    while (end < 0) {
      if (!this.#fill()) return null;
      end = this.#buffer.indexOf(NEWLINE);
    }
    const line = Buffer.from(this.#takeBytes(end)).toString("utf8");
    this.#takeBytes(1);
    return line;
  }

  read(count: number): Uint8Array {
    const buffered = this.#takeBytes(count);
    return Buffer.concat([buffered, this.#source.read(count - buffered.length)]);
  }

  #takeBytes(count: number): Uint8Array {
    const bytes = this.#buffer.subarray(0, count);
    this.#buffer = this.#buffer.subarray(count);
    return bytes;
  }

  #fill(): boolean {
    const piece = Buffer.allocUnsafe(PIECE_BYTES);
    const count = readSome(this.#source.descriptor, piece);
    this.#buffer = Buffer.concat([this.#buffer, piece.subarray(0, count)]);
    return count > 0;
  }
}
