/**
 * The decoder of the WebAssembly module for conformance/RUNNER.md: a stream on standard input,
 * --jobs, or --capabilities. Streams are decoded by quarc.wasm through quarc.mjs, as in a page;
 * unit cases are answered by quarc-conformance.wasm, if it has been built.
 */

import { createHash } from "node:crypto";
import { existsSync, readFileSync, readSync, writeSync } from "node:fs";
import { Quarc, QuarcError } from "./quarc.mjs";

const [INPUT, OUTPUT] = [0, 1];
const EXIT = { refused: 1, failed: 2, declined: 3, closedPipe: 141 };
const PIECE_BYTES = 1 << 16;
const NEWLINE = 10;
const LAST_ORDINAL = 2 ** 32 - 1;

const CAPABILITIES =
  "jobs seek recover grow numbers metadata updates snapshots".split(" ");

/** The input is not a job, which says nothing about a stream. */
class MalformedJob extends Error {}

const compile = (file) => new WebAssembly.Module(readFileSync(file));
const compiled = compile(process.env.QUARC_WASM ?? new URL("quarc.wasm", import.meta.url));
const unitsFile = new URL("quarc-conformance.wasm", import.meta.url);
const units = existsSync(unitsFile) ? start(compile(unitsFile)) : null;

/** A new instance, whose memory is freed with the stream. */
function start(module = compiled) {
  return new Quarc(new WebAssembly.Instance(module, {}));
}

function say(line) {
  write(`${JSON.stringify(line)}\n`);
}

function write(text) {
  const bytes = Buffer.from(text);
  for (let done = 0; done < bytes.length; ) done += writeSync(OUTPUT, bytes, done);
}

/** Read at most one piece of standard input; empty at its end. */
function readSome() {
  const piece = Buffer.allocUnsafe(PIECE_BYTES);
  try {
    return piece.subarray(0, readSync(INPUT, piece));
  } catch (error) {
    if (error.code === "EOF") return piece.subarray(0, 0);
    throw error;
  }
}

/** Report the frames and gaps of a decoder; returns whether it waits for more bytes. */
function tell(decoder, job) {
  for (;;) {
    const { state, gap, isOver } = decoder.pull();
    if (gap) tellGap(gap);
    else if (state) tellFrame(decoder, state, job);
    else return isOver !== true;
  }
}

function tellGap({ offset, bytes, framesLost, rejectId }) {
  say({ gap: { offset, bytes, refused: rejectId, frames_lost: framesLost } });
}

function tellFrame(decoder, { frame, count }, job) {
  const line = { frame, gaussians: count, sha256: decoder.digest() };
  if (job.values) line.values = serialize(decoder.dequantize()).toString("hex");
  else if (job.numbers) {
    const numbers = serialize(decoder.dequantize());
    line.numbers_sha256 = createHash("sha256").update(numbers).digest("hex");
  }
  say(line);
}

/** The floats of a state, row by row in the order of the serialization. */
function serialize({ count, positions, rotations, logScales, opacities, sh, shCoefficients }) {
  const arrays = [positions, rotations, logScales, opacities, sh];
  const widths = [3, 4, 3, 1, 3 * shCoefficients];
  const bytes = Buffer.alloc(4 * count * widths.reduce((sum, width) => sum + width));
  let place = 0;
  arrays.forEach((array, which) => {
    for (let row = 0; row < widths[which]; row++) {
      for (let index = row; index < array.length; index += widths[which]) {
        place = bytes.writeFloatLE(array[index], place);
      }
    }
  });
  return bytes;
}

/** Report the outcome of a stream; returns the exit status. */
function answer(decoder, decode) {
  try {
    decode(decoder);
    return 0;
  } catch (error) {
    if (!(error instanceof QuarcError)) throw error;
    const key = error.rejectId === null ? "declined" : "refused";
    say({ [key]: error.rejectId ?? error.message, message: error.message });
    return EXIT[key];
  } finally {
    decoder.close();
  }
}

/** Decode the stream on standard input as it arrives. */
function answerStream() {
  return answer(start().open(), (decoder) => {
    for (let bytes = readSome(); bytes.length > 0; bytes = readSome()) {
      decoder.push(bytes);
      tell(decoder, {});
    }
    decoder.finish();
    tell(decoder, {});
  });
}

function parseJob(line) {
  let job = null;
  try {
    job = JSON.parse(line);
  } catch {} // it is checked below
  const isCount = (number) => Number.isSafeInteger(number) && number >= 0;
  if (typeof job?.job !== "string" || !isCount(job.bytes ?? 0) || !isCount(job.start ?? 0)) {
    throw new MalformedJob(`not a job: ${line.toString().trim().slice(0, 60)}`);
  }
  return job;
}

function answerJob(job, stream, line) {
  if (job.job === "unit" && units !== null) {
    write(answerUnit(line));
    return;
  }
  if (job.job !== "decode" && job.job !== "recover") {
    say({ unsupported: job.job });
    return;
  }
  const quarc = start();
  const open = () => {
    if (job.job === "recover") return quarc.openRecover();
    if (job.start === undefined) return quarc.open();
    return quarc.openSeek(Math.min(job.start, LAST_ORDINAL));
  };
  answer(open(), (decoder) => {
    decoder.push(stream);
    decoder.finish();
    tell(decoder, job);
  });
}

/** The answer of quarc-conformance.wasm to a request; to an empty one, its capabilities. */
function answerUnit(line) {
  const { quarc_conformance_job: ask, quarc_free: free } = units.functions;
  return units.lend(line, (place) => {
    if (ask(place, line.length, units.scratch) !== 0) throw new MalformedJob("malformed job");
    const [size, lines] = units.view(Uint32Array, units.scratch, 2);
    const text = Buffer.from(units.view(Uint8Array, lines, size)).toString();
    free(lines, size);
    return text;
  });
}

/** Do jobs until standard input ends. */
function answerJobs() {
  let pending = Buffer.alloc(0);
  const fill = () => {
    const bytes = readSome();
    pending = Buffer.concat([pending, bytes]);
    return bytes.length > 0;
  };
  const take = (count) => {
    while (pending.length < count && fill());
    const taken = pending.subarray(0, count);
    pending = pending.subarray(count);
    return taken;
  };
  for (;;) {
    while (!pending.includes(NEWLINE)) if (!fill()) return 0;
    const line = take(pending.indexOf(NEWLINE) + 1);
    const job = parseJob(line);
    const stream = take(job.bytes ?? 0);
    if (stream.length < (job.bytes ?? 0)) {
      throw new MalformedJob("the input ends within the stream of a job");
    }
    answerJob(job, stream, line);
    say({ done: true });
  }
}

function main(argument) {
  if (argument === undefined) return answerStream();
  if (argument === "--jobs") return answerJobs();
  if (argument === "--capabilities") {
    const known = units === null ? [] : JSON.parse(answerUnit(new Uint8Array(0))).units;
    say({ capabilities: CAPABILITIES, units: known });
    return 0;
  }
  process.stderr.write("usage: node conformance.mjs [--jobs | --capabilities] < stream.quarc\n");
  return EXIT.failed;
}

/** The exit status after an error of standard input or output, or a malformed job. */
function fail(error) {
  if (error.syscall === undefined && !(error instanceof MalformedJob)) throw error;
  if (error.code === "EPIPE") return EXIT.closedPipe;
  process.stderr.write(`conformance.mjs: ${error.message}\n`);
  return EXIT.failed;
}

try {
  process.exitCode = main(process.argv[2]);
} catch (error) {
  process.exitCode = fail(error);
}
