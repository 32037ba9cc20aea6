#!/usr/bin/env node
/** The command-line interface of conformance/RUNNER.md: decodes a stream or runs jobs from standard input. */

import { answerStream } from "./answers.js";
import type { Line } from "./answers.js";
import { answerJobs, CAPABILITIES } from "./jobs.js";
import { FileSource } from "./source.js";

const STANDARD_INPUT = 0;
const EXIT_REFUSED = 1;
const EXIT_USAGE = 2;
const EXIT_DECLINED = 3;

function main(argument: string | undefined): number {
  switch (argument) {
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
      return EXIT_USAGE;
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
 * Write a line of JSON; `bigint` values are written as strings. Writes to files and pipes are not buffered, because the
 * sender of the stream may wait for the line.
 */
function writeLine(line: Line): void {
  const text = JSON.stringify(line, (_, value: unknown) => (typeof value === "bigint" ? value.toString() : value));
  process.stdout.write(`${text}\n`);
}

process.exitCode = main(process.argv[2]);
