/** SNAP: a canonical frame that is coded against the last CANO (SPEC 5.10, 7.9, 8.9). */

import { checkCodes, contextsOfSums, expandRotations } from "./attributes.js";
import type { CodedRotations } from "./attributes.js";
import { checkSteps, decodeGaussians, parseBox, parseSections, readSection } from "./canonical.js";
import type { CanonicalGaussians, PositionBox } from "./canonical.js";
import { allIndices, pick, tabulate } from "./columns.js";
import * as constants from "./constants.js";
import { Fields } from "./fields.js";
import type { Words } from "./fields.js";
import type { StreamHeader } from "./header.js";
import { decodeFixed, decodeSigned, sequenceModels } from "./integers.js";
import type { SequenceModels } from "./integers.js";
import { compareMorton } from "./morton.js";
import type { Rows } from "./motion.js";
import { Model } from "./planes.js";
import type { Section } from "./planes.js";
import { demand } from "./reject.js";
import { checkCounts, checkOrdinal } from "./state.js";
import { decodeFields, indicesOfOnes } from "./updates.js";

/** Number of differences per field: position, rotation, log-scales, opacity, SH DC. */
const FIELD_SIZES = [3, 4, constants.LOG_SCALE_PLANES, constants.OPACITY_PLANES, constants.SH_DC_PLANES];

/** First rows of the differences of position, of the index j, of the other components and of codes. */
const POSITION_START = 0;
const INDEX_ROW = 3;
const PARTS_START = 4;
const CODES_START = 7;

/** Positions of a snapshot span less than this number of position steps on each axis. */
const EXTENT_LIMIT = 2 ** constants.AXIS_BITS_LIMIT;

export interface SnapshotChunk extends PositionBox {
  readonly frame: number;
  /** The ordinal of the frame of its CANO. */
  readonly canonical: number;
  readonly newbornCount: number;
  readonly survivors: Words;
  readonly sections: readonly Words[];
  readonly stateCrc: number;
}

/** The reference that a snapshot is coded against. */
export interface Canonical {
  readonly frame: number;
  readonly gaussians: CanonicalGaussians;
}

/** Which Gaussians of a CANO survive, by their indices in it, and their differences. */
export interface Survivors {
  readonly indices: Uint32Array;
  /** 14 rows, with a number for each survivor. */
  readonly differences: Rows;
}

/** The models of survivors, which are new for each section. */
export class SurvivorModels {
  readonly lives = new Model(1);
  /** For each field: the context says which of the preceding fields differ. */
  readonly fields = FIELD_SIZES.map((_, field) => new Model(2 ** field));
  readonly index = sequenceModels(constants.ROTATION_INDEX_BITS);
  readonly differences = sequenceModels(constants.CLASS_BITS, constants.REST_CLASSES * constants.SURVIVOR_ROWS);
}

export function parseSnapshot(payload: Uint8Array): SnapshotChunk {
  const fields = new Fields(payload);
  const chunk = {
    ...parseOrdinals(fields),
    newbornCount: fields.u32("newborn_count"),
    ...parseBox(fields),
    survivors: fields.section("survivors"),
    sections: parseSections(fields),
    stateCrc: fields.u32("state_crc"),
  };
  fields.end();
  return chunk;
}

/** The ordinals of a snapshot and of its CANO, at the start of its payload. */
export function parseOrdinals(fields: Fields) {
  return { frame: fields.u32("frame"), canonical: fields.u32("canonical") };
}

/** Decode the Gaussians of a snapshot whose frame ordinal must be `due`, unless that is null. */
export function decodeSnapshot(
  chunk: SnapshotChunk,
  canonical: Canonical,
  due: number | null,
  header: StreamHeader,
): CanonicalGaussians {
  checkOrdinal(chunk.frame, due);
  const { frame, gaussians } = canonical;
  demand(chunk.canonical === frame, "frame-order", `against frame ${chunk.canonical}, not the last CANO, ${frame}`);
  checkCounts(chunk.newbornCount, 0, header);
  const count = gaussians.positions[0].length;
  const survivors = readSection(chunk.survivors, (section) => decodeSurvivors(section, new SurvivorModels(), count));
  const total = survivors.indices.length + chunk.newbornCount;
  demand(total >= 1, "count", "a snapshot without Gaussians");
  checkCounts(total, 0, header);
  const left = applyDifferences(survivors, gaussians, header);
  const newborn = decodeGaussians(chunk.sections, chunk.newbornCount, chunk, header);
  return sortGaussians(appendGaussians(left, newborn));
}

/** Decode which of `count` Gaussians survive, and their differences. */
export function decodeSurvivors(section: Section, models: SurvivorModels, count: number): Survivors {
  const indices = indicesOfOnes(section.plane(models.lives, new Int32Array(count)));
  const members = decodeFields(section, models.fields, indices.length);
  const differences: Int32Array[] = [];
  FIELD_SIZES.forEach((size, field) => {
    const asked = members[field];
    const end = differences.length + size;
    if (differences.length === INDEX_ROW) {
      differences.push(spread(decodeFixed(section, models.index, asked.length, 0), asked, indices.length));
    }
    const rows = decodeRows(section, models.differences, differences.length, end, asked.length);
    const inSteps = field === 0 ? rows.map(accumulate) : rows;
    differences.push(...inSteps.map((row) => spread(row, asked, indices.length)));
  });
  return { indices, differences };
}

/** The surviving Gaussians, in the order of the CANO, with the differences added. */
export function applyDifferences(
  { indices, differences }: Survivors,
  gaussians: CanonicalGaussians,
  header: StreamHeader,
): CanonicalGaussians {
  const positions = gaussians.positions.map((row, axis) =>
    addRow(row, indices, differences[POSITION_START + axis]).map((c) => checkSteps(c, header.positionStep)),
  );
  const coded = changeRotations(pickRotations(gaussians.coded, indices), differences);
  const codes = gaussians.codes.map((row, number) =>
    CODES_START + number < constants.SURVIVOR_ROWS
      ? checkCodes(addRow(row, indices, differences[CODES_START + number]))
      : pick(row, indices),
  );
  return { positions, coded, rotations: expandRotations(coded, header.rotationBits), codes };
}

/** The Gaussians in ascending order of Morton keys; the sort is stable. */
export function sortGaussians(gaussians: CanonicalGaussians): CanonicalGaussians {
  const fromLeast = gaussians.positions.map((row) => {
    const least = row.reduce((before, coordinate) => Math.min(before, coordinate));
    return row.map((coordinate) => checkExtent(coordinate - least));
  });
  const order = allIndices(fromLeast[0].length).sort((i, j) => compareMorton(fromLeast, i, j) || i - j);
  return pickGaussians(gaussians, order);
}

/** Decode the rows from `start` to `end` of a field, each as a sequence in contexts of the preceding rows. */
function decodeRows(section: Section, models: SequenceModels, start: number, end: number, count: number): Int32Array[] {
  const sums = new Int32Array(count);
  return Array.from({ length: end - start }, (_, i) => {
    const numbers = decodeSigned(section, models, count, contextsOfSums(start + i, sums));
    numbers.forEach((number, place) => {
      sums[place] += Math.abs(number);
    });
    return numbers;
  });
}

/** Decode the differences of position, each relative to that of the previous survivor. */
function accumulate(row: Int32Array): Int32Array {
  let sum = 0;
  return row.map((more) => {
    sum += more;
    // Positions cannot differ by more than this, even in steps of one lattice unit.
    demand(Math.abs(sum) <= 2 * constants.POSITION_LIMIT, "position-range", `a difference of position of ${sum}`);
    return sum;
  });
}

/** A row of `count` numbers, 0 except at the indices `asked`. */
function spread(numbers: ArrayLike<number>, asked: Uint32Array, count: number): Int32Array {
  const row = new Int32Array(count);
  asked.forEach((place, i) => {
    row[place] = numbers[i];
  });
  return row;
}

/** The numbers of the surviving Gaussians in a row, with their differences added. */
function addRow(row: Int32Array, indices: Uint32Array, differences: Int32Array): Int32Array {
  return tabulate(indices.length, (i) => row[indices[i]] + differences[i]);
}

/** If the index of the omitted component changes, the other three are coded absolutely. */
function changeRotations({ indices, parts }: CodedRotations, differences: Rows): CodedRotations {
  const ofIndex = differences[INDEX_ROW];
  return {
    indices: indices.map((index, i) => (index + ofIndex[i]) % 4),
    parts: parts.map((row, part) =>
      row.map((number, i) => (ofIndex[i] === 0 ? number : 0) + differences[PARTS_START + part][i]),
    ),
  };
}

function checkExtent(fromLeast: number): number {
  demand(fromLeast < EXTENT_LIMIT, "symbol-range", `positions of a snapshot are ${fromLeast} steps apart`);
  return fromLeast;
}

function pickRotations({ indices, parts }: CodedRotations, kept: Uint32Array): CodedRotations {
  return {
    indices: Uint8Array.from(kept, (i) => indices[i]),
    parts: parts.map((row) => pick(row, kept)),
  };
}

function pickGaussians(gaussians: CanonicalGaussians, kept: Uint32Array): CanonicalGaussians {
  return {
    positions: gaussians.positions.map((row) => pick(row, kept)),
    coded: pickRotations(gaussians.coded, kept),
    rotations: gaussians.rotations.map((row) => pick(row, kept)),
    codes: gaussians.codes.map((row) => pick(row, kept)),
  };
}

function appendGaussians(first: CanonicalGaussians, second: CanonicalGaussians): CanonicalGaussians {
  return {
    positions: joinRows(first.positions, second.positions),
    coded: {
      indices: new Uint8Array(Buffer.concat([first.coded.indices, second.coded.indices])),
      parts: joinRows(first.coded.parts, second.coded.parts),
    },
    rotations: joinRows(first.rotations, second.rotations),
    codes: joinRows(first.codes, second.codes),
  };
}

function joinRows(first: Rows, second: Rows): Int32Array[] {
  return first.map((row, i) => {
    const joined = new Int32Array(row.length + second[i].length);
    joined.set(row);
    joined.set(second[i], row.length);
    return joined;
  });
}
