#!/usr/bin/env node
/** The command-line interface of conformance/RUNNER.md: decodes a stream or runs jobs from standard input. */

import { answerStream } from "./answers.js";
import type { Line } from "./answers.js";
import { answerJobs, CAPABILITIES, MalformedJob } from "./jobs.js";
import { FileSource, writeAll } from "./source.js";

const STANDARD_INPUT = 0;
const STANDARD_OUTPUT = 1;
const EXIT_REFUSED = 1;
const EXIT_FAILED = 2;
const EXIT_DECLINED = 3;
const EXIT_CLOSED_PIPE = 141; // as of a process that SIGPIPE ends

function main(options: readonly string[]): number {
  switch (options.length > 1 ? "" : options[0]) {
    case undefined:
      return decodeInput();
    case "--jobs":
      for (const line of answerJobs(STANDARD_INPUT)) writeLine(line);
      return 0;
    case "--capabilities":
      writeLine(CAPABILITIES);
      return 0;
    default:
      process.stderr.write("usage: node dist/src/main.js [--jobs | --capabilities] < stream.quarc\n");
      return EXIT_FAILED;
  }
}

/** Decode the stream on standard input and return the exit status. */
function decodeInput(): number {
  let status = 0;
  for (const line of answerStream(new FileSource(STANDARD_INPUT))) {
    writeLine(line);
    if ("refused" in line) status = EXIT_REFUSED;
    if ("declined" in line) status = EXIT_DECLINED;
  }
  return status;
}

/**
 * Write a line of JSON; `bigint` values are written as strings. The line is not buffered, because the sender of the
 * stream may wait for it: `process.stdout` would keep it while this program waits for input.
 */
function writeLine(line: Line): void {
  const text = JSON.stringify(line, (_, value: unknown) => (typeof value === "bigint" ? value.toString() : value));
  writeAll(STANDARD_OUTPUT, Buffer.from(`${text}\n`));
}

/** Exit after an error of standard input or output, or a malformed job; throw any other error again. */
function exitAfterError(error: NodeJS.ErrnoException): never {
  if (error.syscall === undefined && !(error instanceof MalformedJob)) throw error;
  if (error.code === "EPIPE") process.exit(EXIT_CLOSED_PIPE);
  process.stderr.write(`quarc-decode: ${error.message}\n`);
  process.exit(EXIT_FAILED);
}

try {
  process.exitCode = main(process.argv.slice(2));
} catch (error) {
  exitAfterError(error as NodeJS.ErrnoException);
}
