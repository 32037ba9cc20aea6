/** Runs unit tests of building blocks; conformance/unit/ describes their inputs and outputs. */

import { answerError } from "./answers.js";
import type { Line } from "./answers.js";
import { divideRound, isqrt } from "./arithmetic.js";
import { Coder } from "./coder.js";
import { indicesWhere, tabulate } from "./columns.js";
import { SUM_GUARD_BITS } from "./constants.js";
import { crc32 } from "./crc.js";
import { dequantize } from "./dequantize.js";
import { computeStateCrc, digestState } from "./digest.js";
import type { Words } from "./fields.js";
import { findSurvivors } from "./frame.js";
import * as integers from "./integers.js";
import { AnchorSearch } from "./nearest.js";
import type { Point } from "./nearest.js";
import { philox } from "./philox.js";
import type { Counter, Key } from "./philox.js";
import { halveCounts, Section, computeCodeWeight, computeCountWeight } from "./planes.js";
import { expandRotation, normalize, rotate } from "./rotation.js";
import type { Quaternion } from "./rotation.js";
import { computeAnchorCounts, sampleAnchors } from "./sampler.js";

/** An integer; integers beyond 2^53 are strings. */
type Integer = number | string;
type Pair = readonly [number, number];

interface SequenceInput {
  readonly words: readonly number[];
  readonly contexts: readonly number[];
  readonly width: number;
}

interface CountInput {
  readonly gaussians_per_anchor: number;
  readonly anchor_ratio: number;
  readonly level_count: number;
}

interface SampleInput extends CountInput {
  readonly ids: readonly number[];
  readonly positions: readonly Point[];
  readonly seed: Integer;
  readonly phase: number;
}

interface DigestInput {
  readonly phase: number;
  readonly ids: readonly number[];
  readonly positions: readonly (readonly number[])[];
  readonly rotations: readonly (readonly number[])[];
  readonly codes: readonly (readonly number[])[];
}

/** The building blocks by name. */
export const UNITS: Readonly<Record<string, (input: never) => unknown>> = {
  anchor_counts: (input: CountInput & { gaussians: number }) =>
    computeAnchorCounts(input.gaussians, countFields(input)),
  ascending: ({ words, count }: { words: number[]; count: number }) =>
    decodeAll(words, (section) =>
      integers.decodeAscending(section, integers.makeSequenceModels(6), count, 1n << 62n, "symbol-range"),
    ),
  bind: ({ positions, anchors }: { positions: Point[]; anchors: Point[] }) => {
    const search = new AnchorSearch(toColumns(anchors));
    return positions.map((point) => search.findNearest(point));
  },
  counts: ({ before, plane }: { before: Pair; plane: Pair }) => halveCounts(before[0] + plane[0], before[1] + plane[1]),
  crc: ({ bytes }: { bytes: string }) => crc32(Buffer.from(bytes, "hex")),
  deaths: ({ opacities, count }: { opacities: number[]; count: number }) => {
    const survivors = new Set(findSurvivors(Int32Array.from(opacities), count));
    return Array.from(indicesWhere(opacities.length, (i) => !survivors.has(i)));
  },
  decode_bits: ({ words, weights }: { words: number[]; weights: number[] }) => {
    const coder = new Coder(makeWords(words));
    const bits = weights.map((weight) => coder.decodeBit(weight));
    coder.finish();
    return bits;
  },
  dequantize: ({ code, step }: { code: number; step: string }) =>
    toBits(dequantize(code, Buffer.from(step, "hex").readFloatBE())),
  digest: digestScene,
  divide_round: ({ n, d }: { n: Integer; d: Integer }) => divideRound(BigInt(n), BigInt(d)),
  expand: ({ rotation_bits, j, abc }: { rotation_bits: number; j: number; abc: number[] }) =>
    expandRotation(j, abc, rotation_bits),
  fixed: (input: SequenceInput) => decodeSequence(input, integers.decodeFixed),
  isqrt: ({ v }: { v: Integer }) => isqrt(BigInt(v)),
  normalize: ({ vector }: { vector: Quaternion }) => normalize(vector, SUM_GUARD_BITS),
  philox: ({ counter, key }: { counter: Counter; key: Key }) => philox(counter, key),
  sample: sampleLevels,
  signed: (input: SequenceInput) => decodeSequence(input, integers.decodeSigned),
  turn: ({ rotation, sums }: { rotation: Quaternion; sums: Quaternion }) => rotate(rotation, sums),
  unsigned: (input: SequenceInput) => decodeSequence(input, integers.decodeUnsigned),
  weight_by_counts: ({ zeros, ones }: { zeros: number; ones: number }) => computeCountWeight(zeros, ones),
  weight_of_code: ({ code }: { code: number }) => computeCodeWeight(code),
};

/** Return the result of a building block, its rejection, or `unsupported` if the name is unknown. */
export function answerUnit(name: string, input: unknown): Line {
  if (!Object.hasOwn(UNITS, name)) return { unsupported: name };
  try {
    return { output: UNITS[name](input as never) };
  } catch (error) {
    return answerError(error);
  }
}

type SequenceDecoder = (
  section: Section,
  models: integers.SequenceModels,
  count: number,
  outer: Int32Array,
) => Iterable<number | bigint>;

function decodeSequence({ words, contexts, width }: SequenceInput, decode: SequenceDecoder): unknown[] {
  const models = integers.makeSequenceModels(width, Math.max(0, ...contexts) + 1);
  return decodeAll(words, (section) => decode(section, models, contexts.length, Int32Array.from(contexts)));
}

function decodeAll(words: readonly number[], decode: (section: Section) => Iterable<number | bigint>): unknown[] {
  const section = new Section(makeWords(words));
  const numbers = [...decode(section)];
  section.finish();
  return numbers;
}

function digestScene({ phase, ids, positions, rotations, codes }: DigestInput) {
  const scene = {
    ids: Uint32Array.from(ids),
    positions: toColumns(positions),
    rotations: toColumns(rotations),
    codes: toColumns(codes),
  };
  return {
    crc_all: computeStateCrc(scene, phase, true),
    crc_without_codes: computeStateCrc(scene, phase, false),
    sha256: digestState(scene, phase),
  };
}

function sampleLevels(input: SampleInput): number[][] {
  const scene = { ids: Uint32Array.from(input.ids), positions: toColumns(input.positions) };
  const levels = sampleAnchors(scene, input.phase, { ...countFields(input), seed: BigInt(input.seed) });
  return levels.map((indices) => Array.from(indices, (i) => scene.ids[i]));
}

function countFields({ gaussians_per_anchor, anchor_ratio, level_count }: CountInput) {
  return { gaussiansPerAnchor: gaussians_per_anchor, anchorRatio: anchor_ratio, levelCount: level_count };
}

function toColumns(rows: readonly (readonly number[])[]): Int32Array[] {
  return rows[0].map((_, column) => tabulate(rows.length, (i) => rows[i][column]));
}

function makeWords(words: readonly number[]): Words {
  return { length: words.length, wordAt: (i) => words[i] };
}

function toBits(number: number): string {
  const bytes = Buffer.alloc(4);
  bytes.writeFloatBE(number);
  return bytes.toString("hex");
}
