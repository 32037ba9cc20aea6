/** The command, when its standard input or output fails. */

import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { once } from "node:events";
import { closeSync, openSync } from "node:fs";
import { tmpdir } from "node:os";
import { test } from "node:test";
import { setTimeout } from "node:timers/promises";
import { fileURLToPath } from "node:url";
import { changeByte, makeChunk } from "./edits.js";
import { readStream } from "./spec.js";

const COMMAND = fileURLToPath(new URL("../src/main.js", import.meta.url));

test("a standard input that cannot be read is not a rejection", () => {
  const folder = openSync(tmpdir(), "r");
  const { status, stdout, stderr } = spawnSync(process.execPath, [COMMAND], { stdio: [folder, "pipe", "pipe"] });
  closeSync(folder);

  assert.equal(status, 2);
  assert.equal(stdout.toString(), "");
  assert.match(stderr.toString(), /^quarc-decode: EISDIR.*\n$/);
});

test("a closed pipe ends the command without a message", async () => {
  const command = spawn(process.execPath, [COMMAND]);
  let messages = "";
  command.stderr.on("data", (piece: Buffer) => (messages += piece.toString()));
  command.stdout.destroy();
  await once(command.stdout, "close");
  command.stdin.end(readStream("A"));
  const [status] = (await once(command, "close")) as [number];

  assert.equal(status, 141);
  assert.equal(messages, "");
});

test("a malformed job ends the command with a message", () => {
  const fields = ['"bytes":-1', '"bytes":9', '"start":"a"'].map((field) => `{"job":"decode",${field}}`);
  for (const line of ["malformed", "", "null", "[]", '{"job":5}', ...fields]) {
    const { status, stdout, stderr } = spawnSync(process.execPath, [COMMAND, "--jobs"], { input: `${line}\n` });

    assert.equal(status, 2, line);
    assert.equal(stdout.toString(), "");
    assert.match(stderr.toString(), /^quarc-decode: (not a job: |the input ends within the stream).*\n$/);
  }
});

test("the command has one option at most", () => {
  for (const options of [["--jobs", "x"], ["--capabilities", "--jobs"], ["x"], ["--jobs", ""]]) {
    const { status, stdout, stderr } = spawnSync(process.execPath, [COMMAND, ...options], { input: "" });

    assert.equal(status, 2);
    assert.equal(stdout.toString(), "");
    assert.match(stderr.toString(), /^usage: /);
  }
});

test("lines are written before the command waits for a job", { timeout: 60_000 }, async () => {
  const head = readStream("A").subarray(0, 101);
  const stream = Buffer.concat([head, ...Array.from({ length: 2000 }, (_, i) => makeDamagedNote(i + 1))]);
  const command = spawn(process.execPath, [COMMAND, "--jobs"]);
  command.stdin.write(`${JSON.stringify({ job: "recover", bytes: stream.length })}\n`);
  command.stdin.write(stream);
  await setTimeout(2000); // its lines fill the pipe, and standard input stays open
  let output = "";
  for await (const piece of command.stdout) {
    output += (piece as Buffer).toString();
    if (output.endsWith('{"done":true}\n')) break;
  }
  command.kill();

  assert.equal(output.split("\n").length, 2000 + 3);
});

function makeDamagedNote(sequence: number): Uint8Array {
  const chunk = makeChunk("note", sequence, new Uint8Array(1));
  return changeByte(chunk, 20);
}
