/** The building blocks reproduce the examples of Annex F. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { divideRound, isqrt } from "../src/arithmetic.js";
import { Coder } from "../src/coder.js";
import * as constants from "../src/constants.js";
import { crc32 } from "../src/crc.js";
import { decodeAscending, decodeFixed, decodeSigned, decodeUnsigned, makeSequenceModels } from "../src/integers.js";
import type { SequenceModels } from "../src/integers.js";
import { extractCoordinate } from "../src/morton.js";
import { philox } from "../src/philox.js";
import type { Counter, Key } from "../src/philox.js";
import { halveCounts, Section, computeCodeWeight, computeCountWeight } from "../src/planes.js";
import { REJECT_IDS } from "../src/reject.js";
import { expandRotation, normalize, rotate } from "../src/rotation.js";
import type { Quaternion } from "../src/rotation.js";
import { parseHexWords, parseIntegers, readPlanesExamples, readTable } from "./spec.js";

const makeWords = (numbers: readonly number[]) => ({ length: numbers.length, wordAt: (i: number) => numbers[i] });

/** Decode a sequence in the form that an example names. */
function decodeSequence(
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

const parseQuaternion = (cell: string) => parseIntegers(cell) as unknown as Quaternion;

test("the constants match 3.1", () => {
  const implemented = constants as unknown as Record<string, unknown>;
  const commonConstants = readTable("constants").filter(([name]) => typeof implemented[name] === "number");

  assert.ok(commonConstants.length > 35);
  for (const [name, value] of commonConstants) assert.equal(implemented[name], Number(value), name);
});

test("the levels match 3.2", () => {
  const rows = readTable("levels").map((row) => row.map(Number));
  const implemented = [...constants.LEVELS].map(([level, limits]) => [
    level,
    limits.gaussians,
    limits.births,
    limits.payloadBytes,
  ]);

  assert.deepEqual(implemented, rows);
});

test("the reject ids match 3.3", () => {
  assert.deepEqual(
    [...REJECT_IDS],
    readTable("rejects").map(([id]) => id),
  );
});

test("philox matches F.1", () => {
  for (const [counter, key, expectedWords] of readTable("vectors philox")) {
    assert.deepEqual(
      philox(parseHexWords(counter) as unknown as Counter, parseHexWords(key) as unknown as Key),
      parseHexWords(expectedWords),
    );
  }
});

test("divisions round as in F.2", () => {
  for (const [n, d, quotient] of readTable("vectors divide_round")) {
    assert.equal(divideRound(BigInt(n), BigInt(d)), BigInt(quotient));
  }
});

test("square roots match F.2", () => {
  for (const [value, root] of readTable("vectors isqrt")) assert.equal(isqrt(BigInt(value)), BigInt(root));
});

test("CRCs match F.3", () => {
  for (const [bytes, crc] of readTable("vectors crc")) {
    assert.equal(crc32(Uint8Array.from(parseHexWords(bytes))), Number(crc));
  }
});

test("vectors are normalized as in F.4", () => {
  for (const [vector, guardBits, unit] of readTable("vectors normalize")) {
    assert.deepEqual(normalize(parseQuaternion(vector), Number(guardBits)), parseIntegers(unit));
  }
});

test("rotations are expanded as in F.4", () => {
  for (const [bits, index, components, rotation] of readTable("vectors expand")) {
    assert.deepEqual(expandRotation(Number(index), parseIntegers(components), Number(bits)), parseIntegers(rotation));
  }
});

test("rotations are multiplied as in F.4", () => {
  for (const [previousCounts, residual, product] of readTable("vectors turn")) {
    assert.deepEqual(rotate(parseQuaternion(previousCounts), parseQuaternion(residual)), parseIntegers(product));
  }
});

test("weights are derived from counts as in F.5", () => {
  for (const [zeros, ones, weight] of readTable("vectors weights")) {
    assert.equal(computeCountWeight(Number(zeros), Number(ones)), Number(weight));
  }
});

test("counts are halved as in F.5", () => {
  for (const [previousCounts, planeCounts, counts] of readTable("vectors counts")) {
    const [zeros, ones] = parseIntegers(previousCounts);
    const [moreZeros, moreOnes] = parseIntegers(planeCounts);

    assert.deepEqual(halveCounts(zeros + moreZeros, ones + moreOnes), parseIntegers(counts));
  }
});

test("probability codes have the weights of F.5", () => {
  const weights = readTable("vectors codes").flatMap(([, ...row]) => row.map(Number));

  assert.equal(weights.length, 120);
  weights.forEach((weight, code) => {
    assert.equal(computeCodeWeight(code), weight);
    assert.equal(computeCodeWeight(120 + code), 16777216 - weight);
  });
});

test("the coder reads the bits of F.6 up to the end", () => {
  for (const [bits, weights, wordsText] of readTable("vectors coder")) {
    const coder = new Coder(makeWords(parseHexWords(wordsText)));

    assert.deepEqual(
      parseIntegers(weights).map((weight) => coder.decodeBit(weight)),
      parseIntegers(bits),
    );
    coder.finish();
  }
});

test("integers decode from the planes of F.8", () => {
  const examples = readPlanesExamples();

  assert.equal(examples.length, 5);
  for (const { form, bits, numbers, outer, words: wordsText } of examples) {
    const section = new Section(makeWords(wordsText));
    const models = makeSequenceModels(bits, Math.max(...outer) + 1);

    assert.deepEqual(Array.from(decodeSequence(form, section, models, outer), Number), numbers, form);
    section.finish();
  }
});

test("Morton keys match F.9", () => {
  for (const [point, key] of readTable("vectors morton")) {
    assert.deepEqual(
      [0, 1, 2].map((axis) => extractCoordinate(BigInt(key), axis)),
      parseIntegers(point),
    );
  }
});
