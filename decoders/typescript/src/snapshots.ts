/** Decodes SNAP, a canonical frame that is coded against the last CANO (SPEC 5.10, 7.9, 8.9). */

import { checkCodes, sumContexts, expandRotations } from "./attributes.js";
import type { CodedRotations } from "./attributes.js";
import { checkStepCoordinate, decodeGaussians, parseBox, parseSections, readSection } from "./canonical.js";
import type { CanonicalGaussians, PositionBox } from "./canonical.js";
import { allIndices, pickColumn, tabulate } from "./columns.js";
import * as constants from "./constants.js";
import { Fields } from "./fields.js";
import type { Words } from "./fields.js";
import type { StreamHeader } from "./header.js";
import { decodeFixed, decodeSigned, makeSequenceModels } from "./integers.js";
import type { SequenceModels } from "./integers.js";
import { compareMorton } from "./morton.js";
import type { Rows } from "./motion.js";
import { Model } from "./planes.js";
import type { Section } from "./planes.js";
import { demand } from "./reject.js";
import { checkCounts, checkOrdinal } from "./state.js";
import { decodeFields, findOnes } from "./updates.js";

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
  /** The ordinal of the CANO against which the snapshot is coded. */
  readonly canonical: number;
  readonly newbornCount: number;
  readonly survivors: Words;
  readonly sections: readonly Words[];
  readonly stateCrc: number;
}

/** The CANO against which a snapshot is coded. */
export interface Canonical {
  readonly frame: number;
  readonly gaussians: CanonicalGaussians;
}

/** The Gaussians of a CANO that survive in a snapshot, as indices, and their differences. */
export interface Survivors {
  readonly indices: Uint32Array;
  /** 14 rows, with a number for each survivor. */
  readonly differences: Rows;
}

/** The models of survivors; every section starts with new models. */
export class SurvivorModels {
  readonly survives = new Model(1);
  /** For each field; the context tells which of the preceding fields differ. */
  readonly fields = FIELD_SIZES.map((_, field) => new Model(2 ** field));
  readonly index = makeSequenceModels(constants.ROTATION_INDEX_BITS);
  readonly differences = makeSequenceModels(constants.CLASS_BITS, constants.REST_CLASSES * constants.SURVIVOR_ROWS);
}

export function parseSnapshot(payload: Uint8Array): SnapshotChunk {
  const fields = new Fields(payload);
  const chunk = {
    ...parseOrdinals(fields),
    newbornCount: fields.u32("newborn_count"),
    ...parseBox(fields),
    survivors: fields.words("survivors"),
    sections: parseSections(fields),
    stateCrc: fields.u32("state_crc"),
  };
  fields.finish();
  return chunk;
}

/** Parse the ordinals of a snapshot and of its CANO, at the start of the payload. */
export function parseOrdinals(fields: Fields) {
  return { frame: fields.u32("frame"), canonical: fields.u32("canonical") };
}

/** Decode the Gaussians of a snapshot; its ordinal must be `due`, unless `due` is null. */
export function decodeSnapshot(
  chunk: SnapshotChunk,
  canonical: Canonical,
  due: number | null,
  header: StreamHeader,
): CanonicalGaussians {
  checkOrdinal(chunk.frame, due);
  const { frame, gaussians } = canonical;
  demand(
    chunk.canonical === frame,
    "frame-order",
    `a snapshot refers to frame ${chunk.canonical}, but the last CANO is frame ${frame}`,
  );
  checkCounts(chunk.newbornCount, 0, header);
  const count = gaussians.positions[0].length;
  const survivors = readSection(chunk.survivors, (section) => decodeSurvivors(section, new SurvivorModels(), count));
  const total = survivors.indices.length + chunk.newbornCount;
  demand(total >= 1, "count", "a snapshot has no Gaussians");
  checkCounts(total, 0, header);
  const survivingGaussians = applyDifferences(survivors, gaussians, header);
  const newborn = decodeGaussians(chunk.sections, chunk.newbornCount, chunk, header);
  return sortGaussians(appendGaussians(survivingGaussians, newborn));
}

/** Decode which of `count` Gaussians survive, and the differences of the survivors. */
export function decodeSurvivors(section: Section, models: SurvivorModels, count: number): Survivors {
  const indices = findOnes(section.decodePlane(models.survives, new Int32Array(count)));
  const changedByField = decodeFields(section, models.fields, indices.length);
  const differences: Int32Array[] = [];
  FIELD_SIZES.forEach((size, field) => {
    const changedIndices = changedByField[field];
    const end = differences.length + size;
    if (differences.length === INDEX_ROW) {
      differences.push(
        scatter(decodeFixed(section, models.index, changedIndices.length, 0), changedIndices, indices.length),
      );
    }
    const rows = decodeRows(section, models.differences, differences.length, end, changedIndices.length);
    const differenceRows = field === 0 ? rows.map(accumulateDifferences) : rows;
    differences.push(...differenceRows.map((row) => scatter(row, changedIndices, indices.length)));
  });
  return { indices, differences };
}

/** Return the surviving Gaussians, in the order of the CANO, with their differences added. */
export function applyDifferences(
  { indices, differences }: Survivors,
  gaussians: CanonicalGaussians,
  header: StreamHeader,
): CanonicalGaussians {
  const positions = gaussians.positions.map((row, axis) =>
    addRow(row, indices, differences[POSITION_START + axis]).map((c) => checkStepCoordinate(c, header.positionStep)),
  );
  const codedRotations = changeRotations(pickRotations(gaussians.codedRotations, indices), differences);
  const codes = gaussians.codes.map((row, number) =>
    CODES_START + number < constants.SURVIVOR_ROWS
      ? checkCodes(addRow(row, indices, differences[CODES_START + number]))
      : pickColumn(row, indices),
  );
  return { positions, codedRotations, rotations: expandRotations(codedRotations, header.rotationBits), codes };
}

/** Sort Gaussians by Morton keys, ascending; the sort is stable. */
export function sortGaussians(gaussians: CanonicalGaussians): CanonicalGaussians {
  const relativePositions = gaussians.positions.map((row) => {
    const minimum = row.reduce((minimumSoFar, coordinate) => Math.min(minimumSoFar, coordinate));
    return row.map((coordinate) => checkExtent(coordinate - minimum));
  });
  const order = allIndices(relativePositions[0].length).sort((i, j) => compareMorton(relativePositions, i, j) || i - j);
  return pickGaussians(gaussians, order);
}

/** Decode the rows from `start` to `end` of a field, each as a sequence in contexts of the preceding rows. */
function decodeRows(section: Section, models: SequenceModels, start: number, end: number, count: number): Int32Array[] {
  const sums = new Int32Array(count);
  return Array.from({ length: end - start }, (_, i) => {
    const numbers = decodeSigned(section, models, count, sumContexts(start + i, sums));
    numbers.forEach((number, index) => {
      sums[index] += Math.abs(number);
    });
    return numbers;
  });
}

/** Sum up differences of position, each of which is coded relative to the difference of the previous survivor. */
function accumulateDifferences(row: Int32Array): Int32Array {
  let sum = 0;
  return row.map((difference) => {
    sum += difference;
    // Positions cannot differ by more than this limit, even with a position step of one lattice unit.
    demand(Math.abs(sum) <= 2 * constants.POSITION_LIMIT, "position-range", `two positions differ by ${sum} steps`);
    return sum;
  });
}

/** Return a row of `count` numbers that are 0 except at `changedIndices`. */
function scatter(numbers: ArrayLike<number>, changedIndices: Uint32Array, count: number): Int32Array {
  const row = new Int32Array(count);
  changedIndices.forEach((index, i) => {
    row[index] = numbers[i];
  });
  return row;
}

/** Return the numbers of the surviving Gaussians in a row, with their differences added. */
function addRow(row: Int32Array, indices: Uint32Array, differences: Int32Array): Int32Array {
  return tabulate(indices.length, (i) => row[indices[i]] + differences[i]);
}

/** Add differences to rotations; if the index of the omitted component changes, replace the other components. */
function changeRotations({ indices, components }: CodedRotations, differences: Rows): CodedRotations {
  const indexDifferences = differences[INDEX_ROW];
  return {
    indices: indices.map((index, i) => (index + indexDifferences[i]) % 4),
    components: components.map((row, part) =>
      row.map((number, i) => (indexDifferences[i] === 0 ? number : 0) + differences[PARTS_START + part][i]),
    ),
  };
}

function checkExtent(distance: number): number {
  demand(distance < EXTENT_LIMIT, "symbol-range", `positions of a snapshot are ${distance} steps apart`);
  return distance;
}

function pickRotations({ indices, components }: CodedRotations, survivors: Uint32Array): CodedRotations {
  return {
    indices: Uint8Array.from(survivors, (i) => indices[i]),
    components: components.map((row) => pickColumn(row, survivors)),
  };
}

function pickGaussians(gaussians: CanonicalGaussians, indices: Uint32Array): CanonicalGaussians {
  return {
    positions: gaussians.positions.map((row) => pickColumn(row, indices)),
    codedRotations: pickRotations(gaussians.codedRotations, indices),
    rotations: gaussians.rotations.map((row) => pickColumn(row, indices)),
    codes: gaussians.codes.map((row) => pickColumn(row, indices)),
  };
}

function appendGaussians(first: CanonicalGaussians, second: CanonicalGaussians): CanonicalGaussians {
  return {
    positions: joinRows(first.positions, second.positions),
    codedRotations: {
      indices: new Uint8Array(Buffer.concat([first.codedRotations.indices, second.codedRotations.indices])),
      components: joinRows(first.codedRotations.components, second.codedRotations.components),
    },
    rotations: joinRows(first.rotations, second.rotations),
    codes: joinRows(first.codes, second.codes),
  };
}

function joinRows(first: Rows, second: Rows): Int32Array[] {
  return first.map((row, i) => {
    const result = new Int32Array(row.length + second[i].length);
    result.set(row);
    result.set(second[i], row.length);
    return result;
  });
}
