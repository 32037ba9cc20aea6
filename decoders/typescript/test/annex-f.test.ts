/** The examples of Annex F. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { divideRound, isqrt } from "../src/arithmetic.js";
import { Coder } from "../src/coder.js";
import * as constants from "../src/constants.js";
import { crc32 } from "../src/crc.js";
import { decodeAscending, decodeFixed, decodeSigned, decodeUnsigned, sequenceModels } from "../src/integers.js";
import type { SequenceModels } from "../src/integers.js";
import { coordinateOfKey } from "../src/morton.js";
import { philox } from "../src/philox.js";
import type { Counter, Key } from "../src/philox.js";
import { halved, Section, weightOfCode, weightOfCounts } from "../src/planes.js";
import { REJECT_IDS } from "../src/reject.js";
import { expandRotation, normalize, turn } from "../src/rotation.js";
import type { Quaternion } from "../src/rotation.js";
import { hexWords, integers, planesExamples, table } from "./spec.js";

const words = (numbers: readonly number[]) => ({ length: numbers.length, at: (i: number) => numbers[i] });

/** A sequence of the form named in an example. */
function decodeForm(
  form: string,
  section: Section,
  models: SequenceModels,
  outer: readonly number[],
): Iterable<unknown> {
  const contexts = Int32Array.from(outer);
  switch (form) {
    case "Fixed":
      return decodeFixed(section, models, outer.length, contexts);
    case "Unsigned":
      return decodeUnsigned(section, models, outer.length, contexts);
    case "Signed":
      return decodeSigned(section, models, outer.length, contexts);
    default:
      return decodeAscending(section, models, outer.length, 2n ** 60n, "symbol-range");
  }
}

const quaternion = (cell: string) => integers(cell) as unknown as Quaternion;

test("the constants match 3.1", () => {
  const ours = constants as unknown as Record<string, unknown>;
  const shared = table("constants").filter(([name]) => typeof ours[name] === "number");

  assert.ok(shared.length > 35);
  for (const [name, value] of shared) assert.equal(ours[name], Number(value), name);
});

test("the levels match 3.2", () => {
  const rows = table("levels").map((row) => row.map(Number));
  const ours = [...constants.LEVELS].map(([level, at]) => [level, at.gaussians, at.births, at.payloadBytes]);

  assert.deepEqual(ours, rows);
});

test("the reject ids match 3.3", () => {
  assert.deepEqual(
    [...REJECT_IDS],
    table("rejects").map(([id]) => id),
  );
});

test("philox matches F.1", () => {
  for (const [counter, key, drawn] of table("vectors philox")) {
    assert.deepEqual(philox(hexWords(counter) as unknown as Counter, hexWords(key) as unknown as Key), hexWords(drawn));
  }
});

test("divisions round as in F.2", () => {
  for (const [n, d, quotient] of table("vectors divide_round")) {
    assert.equal(divideRound(BigInt(n), BigInt(d)), BigInt(quotient));
  }
});

test("square roots match F.2", () => {
  for (const [value, root] of table("vectors isqrt")) assert.equal(isqrt(BigInt(value)), BigInt(root));
});

test("CRCs match F.3", () => {
  for (const [bytes, crc] of table("vectors crc")) {
    assert.equal(crc32(Uint8Array.from(hexWords(bytes))), Number(crc));
  }
});

test("vectors are normalized as in F.4", () => {
  for (const [vector, guardBits, unit] of table("vectors normalize")) {
    assert.deepEqual(normalize(quaternion(vector), Number(guardBits)), integers(unit));
  }
});

test("rotations are expanded as in F.4", () => {
  for (const [bits, index, three, rotation] of table("vectors expand")) {
    assert.deepEqual(expandRotation(Number(index), integers(three), Number(bits)), integers(rotation));
  }
});

test("rotations are multiplied as in F.4", () => {
  for (const [before, residual, turned] of table("vectors turn")) {
    assert.deepEqual(turn(quaternion(before), quaternion(residual)), integers(turned));
  }
});

test("weights are derived from counts as in F.5", () => {
  for (const [zeros, ones, weight] of table("vectors weights")) {
    assert.equal(weightOfCounts(Number(zeros), Number(ones)), Number(weight));
  }
});

test("counts are halved as in F.5", () => {
  for (const [before, read, counts] of table("vectors counts")) {
    const [zeros, ones] = integers(before);
    const [moreZeros, moreOnes] = integers(read);

    assert.deepEqual(halved(zeros + moreZeros, ones + moreOnes), integers(counts));
  }
});

test("probability codes have the weights of F.5", () => {
  const weights = table("vectors codes").flatMap(([, ...row]) => row.map(Number));

  assert.equal(weights.length, 120);
  weights.forEach((weight, code) => {
    assert.equal(weightOfCode(code), weight);
    assert.equal(weightOfCode(120 + code), 16777216 - weight);
  });
});

test("the coder reads the bits of F.6 up to the end", () => {
  for (const [bits, weights, stored] of table("vectors coder")) {
    const coder = new Coder(words(hexWords(stored)));

    assert.deepEqual(
      integers(weights).map((weight) => coder.bit(weight)),
      integers(bits),
    );
    coder.finish();
  }
});

test("integers decode from the planes of F.8", () => {
  const examples = planesExamples();

  assert.equal(examples.length, 5);
  for (const { form, bits, numbers, outer, words: stored } of examples) {
    const section = new Section(words(stored));
    const models = sequenceModels(bits, Math.max(...outer) + 1);

    assert.deepEqual(Array.from(decodeForm(form, section, models, outer), Number), numbers, form);
    section.finish();
  }
});

test("Morton keys match F.9", () => {
  for (const [point, key] of table("vectors morton")) {
    assert.deepEqual(
      [0, 1, 2].map((axis) => coordinateOfKey(BigInt(key), axis)),
      integers(point),
    );
  }
});
