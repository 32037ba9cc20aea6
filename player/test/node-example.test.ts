/** The Node example prints what it should. */

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { fileURLToPath } from "node:url";
import { test } from "node:test";

const here = (path: string): string => fileURLToPath(new URL(path, import.meta.url));

function run(vector: string, ...more: string[]): { status: number | null; out: string; error: string } {
  const file = here(`../../conformance/${vector}.quarc`);
  const done = spawnSync(process.execPath, [here("../examples/node.mjs"), file, ...more]);
  return { status: done.status, out: String(done.stdout), error: String(done.stderr) };
}

test("it lists the frames from a given one on", () => {
  const { status, out } = run("streams/journey", "7");
  assert.equal(status, 0);
  const [head, ...frames] = out.trim().split("\n");
  assert.equal(head, "9 frames, 30 a second, 1 cameras");
  assert.deepEqual(frames.map((line) => line.split(":")[0]), ["frame 7", "frame 8"]);
});

test("it prints the reject id of a damaged stream", () => {
  const { status, error } = run("damaged/byte-lost");
  assert.equal(status, 1);
  assert.match(error, /^rejected \([a-z-]+\): /);
});
