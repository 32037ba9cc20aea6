/**
 * The module as conformance/RUNNER.md asks for it: a stream on standard input, --jobs, or
 * --capabilities. Streams are decoded by quarc.mjs, as a page would; units by the module.
 */

import { createHash } from "node:crypto";
import { readFileSync, readSync, writeSync } from "node:fs";
import { Quarc, QuarcError } from "./quarc.mjs";

const [INPUT, OUTPUT] = [0, 1];
const EXIT = { refused: 1, declined: 3 };
const PIECE_BYTES = 1 << 16;
const NEWLINE = 10;

const file = process.env.QUARC_WASM ?? new URL("quarc.wasm", import.meta.url);
const compiled = new WebAssembly.Module(readFileSync(file));

/** A module without a past: what a stream made it grow to is gone with the stream. */
function start() {
  return new Quarc(new WebAssembly.Instance(compiled, {}));
}

function say(line) {
  write(`${JSON.stringify(line)}\n`);
}

function write(text) {
  const bytes = Buffer.from(text);
  for (let done = 0; done < bytes.length; ) done += writeSync(OUTPUT, bytes, done);
}

/** What is there of standard input, at most a piece; nothing at its end. */
function readSome() {
  const piece = Buffer.allocUnsafe(PIECE_BYTES);
  try {
    return piece.subarray(0, readSync(INPUT, piece));
  } catch (error) {
    if (error.code === "EOF") return piece.subarray(0, 0);
    throw error;
  }
}

/** Say what a decoder gives; returns whether it waits for more bytes. */
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

/** What a state dequantizes to, row by row as it is serialized. */
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

/** Say what becomes of a stream; returns the exit status. */
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

/** The stream on standard input, as it comes. */
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

function answerJob(job, stream, line) {
  const quarc = start();
  if (job.job === "unit") return write(answerUnit(quarc, line));
  const open = () => {
    if (job.job === "recover") return quarc.openRecover();
    return job.start === undefined ? quarc.open() : quarc.openSeek(job.start);
  };
  answer(open(), (decoder) => {
    decoder.push(stream);
    decoder.finish();
    tell(decoder, job);
  });
}

/** What the module itself answers to a line: bytes. */
function answerUnit(quarc, line) {
  return quarc.lend(line, (place) => {
    const { quarc_conformance_job: ask, quarc_free: free } = quarc.functions;
    if (ask(place, line.length, 0, quarc.scratch) !== 0) throw new Error("this is no job");
    const [size, lines] = quarc.view(Uint32Array, quarc.scratch, 2);
    const text = Buffer.from(quarc.view(Uint8Array, lines, size)).toString();
    free(lines, size);
    return text;
  });
}

/** Jobs, until standard input ends. */
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
    const job = JSON.parse(line);
    answerJob(job, take(job.bytes ?? 0), line);
    say({ done: true });
  }
}

function main(argument) {
  if (argument === undefined) return answerStream();
  if (argument === "--jobs") return answerJobs();
  if (argument === "--capabilities") {
    write(answerUnit(start(), new Uint8Array(0)));
    return 0;
  }
  process.stderr.write("usage: node conformance.mjs [--jobs | --capabilities] < stream.quarc\n");
  return 2;
}

process.exitCode = main(process.argv[2]);
