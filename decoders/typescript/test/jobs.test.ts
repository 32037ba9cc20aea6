/** Jobs, units and floats, as the runner requests them. */

import assert from "node:assert/strict";
import { closeSync, mkdtempSync, openSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import { dequantize } from "../src/dequantize.js";
import { answerJobs } from "../src/jobs.js";
import { streamBytes, table } from "./spec.js";

/** The lines of output for an input. */
function answers(...input: readonly (object | Uint8Array)[]): object[] {
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

test("jobs are answered in order, each with its end", () => {
  const stream = streamBytes("A");
  const decode = { job: "decode", bytes: stream.length };
  const frame = { frame: 0, gaussians: 3, sha256: table("digests A")[0][5] };
  const cut = { job: "decode", bytes: 100 };

  assert.deepEqual(answers(decode, stream, cut, stream.subarray(0, 100), decode, stream), [
    ...[frame, { done: true }],
    ...[{ refused: "truncated" }, { done: true }],
    ...[frame, { done: true }],
  ]);
});

test("recovery answers with frames and gaps in order", () => {
  const stream = streamBytes("A").subarray(0, 260);
  const frame = { frame: 0, gaussians: 3, sha256: table("digests A")[0][5] };
  const gap = { offset: 254, bytes: 6, refused: "truncated", frames_lost: null };

  assert.deepEqual(answers({ job: "recover", bytes: stream.length }, stream), [frame, { gap }, { done: true }]);
});

test("a unit returns a result or a rejection", () => {
  const unit = (code: number) => ({ job: "unit", function: "weight_of_code", input: { code } });

  assert.deepEqual(answers(unit(0), unit(240)), [
    ...[{ output: 256 }, { done: true }],
    ...[{ refused: "bad-probability" }, { done: true }],
  ]);
});

test("a function that is not a unit is unsupported, even if objects inherit its name", () => {
  for (const name of ["constructor", "__proto__", "toString", "nonsense"]) {
    const unit = { job: "unit", function: name, input: { code: 1 } };
    assert.deepEqual(answers(unit), [{ unsupported: name }, { done: true }]);
  }
});

test("floats match F.10", () => {
  const bits = (hex: string) => Buffer.from(hex, "hex").readFloatBE();
  for (const [code, step, number] of table("vectors dequantize")) {
    assert.equal(dequantize(Number(code), bits(step)), bits(number));
  }
});
