/** `node --test core/wasm/quarc.test.mjs`, after build.sh: the module as a page uses it, with intact and damaged streams. */

import assert from "node:assert/strict";
import { createHash } from "node:crypto";
import { spawnSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { Quarc, QuarcError } from "./quarc.mjs";

const STREAMS = new URL("../../conformance/streams/", import.meta.url);
const NAMES = ["journey", "births-and-deaths", "snapshots-journey", "updates-journey"];
const MUTATIONS = 300;
const MODULE_BYTES_LIMIT = 256_000;

const read = (name) => readFileSync(new URL(`${name}.quarc`, STREAMS));
const load = () => Quarc.load(readFileSync(new URL("quarc.wasm", import.meta.url)));

/** The digest of SPEC 9.1, computed from the arrays of the page. */
function digest({ phase, count, ids, positions, rotations, codes }) {
  const hash = createHash("sha256").update(Uint32Array.of(count, phase)).update(ids);
  for (const row of [...positions, ...rotations]) hash.update(row);
  for (const row of codes) hash.update(Int32Array.from(row));
  return hash.digest("hex");
}

function* pull(decoder) {
  for (let found = decoder.pull(); found.state || found.gap; found = decoder.pull()) yield found;
}

/** A deterministic generator of numbers. */
function* numbers(seed) {
  for (let state = seed; ; ) {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    yield state >>> 8;
  }
}

test("the module has at most 250 KB", () => {
  const { length } = readFileSync(new URL("quarc.wasm", import.meta.url));
  assert.ok(length <= MODULE_BYTES_LIMIT, `quarc.wasm has ${length} bytes`);
});

test("errors on loading say what failed", async () => {
  const url = "http://127.0.0.1:9/quarc.wasm"; // the discard port, on which nothing listens
  await assert.rejects(Quarc.load(fetch(url)), /^Error: quarc.wasm cannot be read: /);
  const missing = new Response("<html>", { status: 404 });
  await assert.rejects(Quarc.load(missing), /^Error: quarc.wasm cannot be read: .* status 404$/);
  const notWasm = /^Error: this is not quarc.wasm: /;
  await assert.rejects(Quarc.load(new Response("<html>")), notWasm);
  await assert.rejects(Quarc.load("quarc.wasm"), notWasm);
  const empty = Uint8Array.of(0, 0x61, 0x73, 0x6d, 1, 0, 0, 0);
  await assert.rejects(Quarc.load(empty), /quarc.wasm: the module lacks the functions/);
  await assert.rejects(Quarc.load(new WebAssembly.Module(empty)), /lacks the functions/);
});

test("addresses above 2 GiB are not negative", () => {
  const memory = { buffer: new Uint8Array(16).buffer };
  const returned = -16; // of a 32-bit number without a sign: 2^32 - 16
  const functions = { memory, quarc_allocate: () => returned, quarc_version: () => returned };
  const quarc = new Quarc({ exports: functions });
  assert.equal(quarc.scratch, 2 ** 32 - 16);
  assert.throws(() => quarc.version, /4294967280 is outside the bounds/);
});

test("memory is not allocated for other numbers than sizes of 32 bits", async () => {
  const quarc = await load();
  for (const size of [2 ** 32, 2 ** 32 - 1, -1, 1.5, NaN]) {
    assert.throws(() => quarc.allocate(size), /^RangeError: cannot allocate/);
  }
});

test("bytes are passed as a Uint8Array", async () => {
  const decoder = (await load()).open();
  assert.throws(() => decoder.push(new ArrayBuffer(8)), /needs a Uint8Array/);
});

test("the arrays of a state match its digest", async () => {
  const quarc = await load();
  for (const name of NAMES) {
    const decoder = quarc.open();
    let frames = 0;
    const stream = read(name);
    for (let place = 0; place < stream.length; place += 100) {
      decoder.push(stream.subarray(place, place + 100));
      for (const { state } of pull(decoder)) {
        assert.equal(digest(state), decoder.digest(), name);
        frames++;
      }
    }
    decoder.finish();
    assert.deepEqual(decoder.pull(), { isOver: true });
    assert.ok(frames > 2, name);
    decoder.close();
  }
});

test("floats are the integers times the steps in HEAD", async () => {
  const decoder = (await load()).open();
  assert.equal(decoder.head, null);
  decoder.push(read("journey"));
  const { state } = decoder.pull();
  const { head } = decoder;
  const splats = decoder.dequantize();
  const { count } = state;
  assert.equal(splats.shCoefficients, head.shDegree === 0 ? 1 : 4);
  for (let index = 0; index < count; index++) {
    const steps = [head.logScaleStep, head.opacityStep, head.shDcStep, head.shRestStep];
    const [logScale, opacity, dc, rest] = steps;
    const position = state.positions[1][index] / 2 ** head.latticeExponent;
    assert.equal(splats.positions[3 * index + 1], Math.fround(position));
    assert.equal(splats.rotations[4 * index], state.rotations[0][index] / 2 ** 22);
    assert.equal(splats.logScales[3 * index + 2], Math.fround(state.codes[2][index] * logScale));
    assert.equal(splats.opacities[index], Math.fround(state.codes[3][index] * opacity));
    const sh = splats.sh.subarray(3 * splats.shCoefficients * index);
    assert.equal(sh[0], Math.fround(state.codes[4][index] * dc));
    if (head.shDegree > 0) assert.equal(sh[3], Math.fround(state.codes[7][index] * rest));
  }
  assert.deepEqual(splats.changed, { positions: true, rotations: true, codes: true });
  assert.deepEqual(decoder.dequantize().changed, {
    ...{ positions: false, rotations: false, codes: false },
  });
  assert.ok(head.timescale > 0 && head.frameTicks > 0 && [10, 20, 30, 31].includes(head.level));
  assert.ok(head.upAxis <= 6 && head.metersPerUnit >= 0 && typeof head.isRightHanded === "boolean");
});

test("seeking returns frames, and recovery reports gaps", async () => {
  const quarc = await load();
  for (const start of [-1, 1.5, 2 ** 32, NaN, "4"]) {
    assert.throws(() => quarc.openSeek(start), /is not the ordinal of a frame/);
  }
  const stream = read("journey");
  const seeking = quarc.openSeek(4);
  seeking.push(stream);
  assert.deepEqual(seeking.pull(), {});
  seeking.finish();
  assert.deepEqual([...pull(seeking)].map(({ state }) => state.frame), [4, 5, 6, 7, 8]);

  stream[stream.length >> 1] ^= 1;
  const recovering = quarc.openRecover();
  recovering.push(stream);
  recovering.finish();
  const found = [...pull(recovering)];
  const gaps = found.filter(({ gap }) => gap).map(({ gap }) => gap);
  assert.equal(gaps.length, 1);
  assert.equal(gaps[0].rejectId, "payload-crc");
  assert.equal(gaps[0].framesLost, 9 - (found.length - 1));
  assert.ok(gaps[0].offset < stream.length >> 1);
  assert.ok(gaps[0].offset + gaps[0].bytes > stream.length >> 1);
});

test("errors have their reject id, and a closed decoder cannot be used", async () => {
  const decoder = (await load()).open();
  assert.throws(() => decoder.digest(), /invalid call: there is no state now/);
  decoder.push(read("journey").subarray(0, -1));
  decoder.finish();
  const isCut = (error) => error instanceof QuarcError && error.rejectId === "truncated";
  assert.throws(() => [...pull(decoder)], isCut);
  assert.throws(() => decoder.pull(), isCut);
  decoder.close();
  decoder.close();
  assert.throws(() => decoder.pull(), /invalid call: the decoder is closed/);
});

test("the answers to malformed jobs are a message and a status", () => {
  const script = new URL("conformance.mjs", import.meta.url).pathname;
  const run = (input) => spawnSync(process.execPath, [script, "--jobs"], { input });
  const fields = ['"bytes":-1', '"bytes":1.5', '"start":"4"', '"bytes":1'];
  const malformed = fields.map((field) => `{"job":"decode",${field}}`);
  for (const line of ["malformed", "", "null", "[]", '{"job":5}', ...malformed]) {
    const { status, stdout, stderr } = run(`${line}\n`);
    assert.equal(status, 2, line);
    assert.equal(stdout.length, 0);
    assert.match(stderr.toString(), /^conformance.mjs: .+\n$/);
  }
  const { status, stdout } = run('{"job":"dance"}\n');
  assert.equal(status, 0);
  assert.deepEqual(stdout.toString(), '{"unsupported":"dance"}\n{"done":true}\n');
});

test("modified streams cause no crash, and memory is reused", async () => {
  const quarc = await load();
  const random = numbers(7);
  const below = (bound) => random.next().value % bound;
  const streams = NAMES.map(read);
  const decode = () => {
    const stream = Buffer.from(streams[below(streams.length)]);
    for (let change = below(3); change > 0; change--) stream[below(stream.length)] ^= 1 << below(8);
    const opened = [() => quarc.open(), () => quarc.openSeek(below(9)), () => quarc.openRecover()];
    const decoder = opened[below(3)]();
    try {
      decoder.push(stream.subarray(0, stream.length - below(2) * below(stream.length)));
      decoder.finish();
      for (const { state } of pull(decoder)) {
        if (state) assert.equal(decoder.dequantize().count, state.count);
      }
      return 0;
    } catch (error) {
      assert.ok(error instanceof QuarcError && error.rejectId !== null, error);
      return 1;
    } finally {
      decoder.close();
    }
  };
  let rejected = 0;
  for (let time = 0; time < MUTATIONS; time++) rejected += decode();
  const { memoryBytes } = quarc;
  for (let time = 0; time < MUTATIONS; time++) rejected += decode();
  assert.equal(quarc.memoryBytes, memoryBytes);
  assert.ok(rejected > MUTATIONS / 2 && rejected < 2 * MUTATIONS, `${rejected}`);
});
