/** The output of examples/node.mjs. */

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { fileURLToPath } from "node:url";
import { test } from "node:test";

const resolvePath = (path: string): string => fileURLToPath(new URL(path, import.meta.url));

interface ExampleResult { status: number | null; stdout: string; stderr: string }

const runExample = (vector: string, ...args: string[]): ExampleResult => runNode([], vector, ...args);

function runNode(options: string[], vector: string, ...args: string[]): ExampleResult {
  const file = resolvePath(`../../conformance/${vector}.quarc`);
  const result = spawnSync(process.execPath, [...options, resolvePath("../examples/node.mjs"), file, ...args]);
  return { status: result.status, stdout: String(result.stdout), stderr: String(result.stderr) };
}

test("it lists the frames from a given frame onwards", () => {
  const { status, stdout } = runExample("streams/journey", "7");
  assert.equal(status, 0);
  const [summaryLine, ...frameLines] = stdout.trim().split("\n");
  assert.equal(summaryLine, "9 frames, 30 per second, 1 cameras");
  assert.deepEqual(frameLines.map((line) => line.split(":")[0]), ["frame 7", "frame 8"]);
});

test("it prints the reject id of a damaged stream", () => {
  const { status, stderr } = runExample("damaged/byte-lost");
  assert.equal(status, 1);
  assert.match(stderr, /^rejected \([a-z-]+\): /);
});

test("without WebAssembly, as in some private browsers, the error says so", () => {
  const { status, stderr } = runNode(["--jitless"], "streams/journey");
  assert.equal(status, 1);
  assert.match(stderr, /the decoder cannot be loaded: ReferenceError: WebAssembly is not defined/);
});
