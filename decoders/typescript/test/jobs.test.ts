/** Jobs, units and dequantized numbers, as conformance/run.py requests them. */

import assert from "node:assert/strict";
import { closeSync, mkdtempSync, openSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import { dequantize } from "../src/dequantize.js";
import { answerJobs } from "../src/jobs.js";
import { readStream, readTable } from "./spec.js";

/** Run jobs; return the output lines. */
function runJobs(...input: readonly (object | Uint8Array)[]): object[] {
  const folder = mkdtempSync(join(tmpdir(), "jobs-"));
  const path = join(folder, "input");
  const pieces = input.map((part) => (part instanceof Uint8Array ? part : Buffer.from(`${JSON.stringify(part)}\n`)));
  writeFileSync(path, Buffer.concat(pieces));
  const descriptor = openSync(path, "r");
  try {
    return [...answerJobs(descriptor)];
  } finally {
    closeSync(descriptor);
    rmSync(folder, { recursive: true });
  }
}

test("jobs are answered in order, each with a last line done", () => {
  const stream = readStream("A");
  const decodeJob = { job: "decode", bytes: stream.length };
  const frameLine = { frame: 0, gaussians: 3, sha256: readTable("digests A")[0][5] };
  const truncatedJob = { job: "decode", bytes: 100 };

  assert.deepEqual(runJobs(decodeJob, stream, truncatedJob, stream.subarray(0, 100), decodeJob, stream), [
    ...[frameLine, { done: true }],
    ...[{ refused: "truncated" }, { done: true }],
    ...[frameLine, { done: true }],
  ]);
});

test("recovery answers with frames and gaps in order", () => {
  const stream = readStream("A").subarray(0, 260);
  const frameLine = { frame: 0, gaussians: 3, sha256: readTable("digests A")[0][5] };
  const gapLine = { offset: 254, bytes: 6, refused: "truncated", frames_lost: null };

  assert.deepEqual(runJobs({ job: "recover", bytes: stream.length }, stream), [
    frameLine,
    { gap: gapLine },
    { done: true },
  ]);
});

test("a unit returns a result or a rejection", () => {
  const makeUnitJob = (code: number) => ({ job: "unit", function: "weight_of_code", input: { code } });

  assert.deepEqual(runJobs(makeUnitJob(0), makeUnitJob(240)), [
    ...[{ output: 256 }, { done: true }],
    ...[{ refused: "bad-probability" }, { done: true }],
  ]);
});

test("an unknown unit is unsupported, even if it has the name of an inherited property", () => {
  for (const name of ["constructor", "__proto__", "toString", "nonsense"]) {
    const makeUnitJob = { job: "unit", function: name, input: { code: 1 } };
    assert.deepEqual(runJobs(makeUnitJob), [{ unsupported: name }, { done: true }]);
  }
});

test("a job of an unknown kind is unsupported", () => {
  assert.deepEqual(runJobs({ job: "dance" }), [{ unsupported: "dance" }, { done: true }]);
});

test("floats match F.10", () => {
  const parseFloat32 = (hex: string) => Buffer.from(hex, "hex").readFloatBE();
  for (const [code, step, number] of readTable("vectors dequantize")) {
    assert.equal(dequantize(Number(code), parseFloat32(step)), parseFloat32(number));
  }
});
