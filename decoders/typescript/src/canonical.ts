/** CANO: a scene from nothing (SPEC 5.4, 7.2, 8.5). */

import {
  AttributeModels,
  checkPosition,
  decodeRotations,
  decodeRowsApart,
  decodeShDc,
  checkCodes,
} from "./attributes.js";
import { bitLength } from "./arithmetic.js";
import { allIndices, tabulate } from "./columns.js";
import * as constants from "./constants.js";
import { Fields } from "./fields.js";
import type { Words } from "./fields.js";
import type { StreamHeader } from "./header.js";
import { decodeAscending, decodeSigned, sequenceModels } from "./integers.js";
import { coordinateOfKey } from "./morton.js";
import { Section } from "./planes.js";
import { newScene } from "./scene.js";
import type { Scene } from "./scene.js";

export interface CanonicalChunk {
  readonly frame: number;
  readonly gaussianCount: number;
  readonly origin: readonly number[];
  readonly axisBits: number;
  readonly sections: readonly Words[];
  readonly stateCrc: number;
}

export function parseCanonical(payload: Uint8Array): CanonicalChunk {
  const fields = new Fields(payload);
  const chunk = {
    frame: fields.u32("frame"),
    gaussianCount: fields.u32("gaussian_count"),
    origin: ["x", "y", "z"].map((axis) => fields.i32(`origin ${axis}`)),
    axisBits: fields.u8("axis_bits", 0, constants.AXIS_BITS_LIMIT),
    sections: Array.from({ length: constants.CANONICAL_SECTIONS }, (_, i) => fields.section(`sections[${i}]`)),
    stateCrc: fields.u32("state_crc"),
  };
  fields.end();
  return chunk;
}

/** The scene of a canonical frame, whose count of Gaussians has been held against the level. */
export function decodeCanonicalScene(chunk: CanonicalChunk, header: StreamHeader): Scene {
  const count = chunk.gaussianCount;
  const models = new AttributeModels();
  const [keys, shDc, opacity, logScales, rotations, shRest] = chunk.sections;
  const coded = {
    ids: allIndices(count),
    positions: readSection(keys, (section) => decodePositions(section, chunk, header.positionStep)),
    dc: readSection(shDc, (section) => decodeShDc(section, models, count)),
    opacity: readSection(opacity, (section) =>
      decodeRowsApart(section, models.opacity, constants.OPACITY_PLANES, count),
    ),
    logScales: readSection(logScales, (section) =>
      decodeRowsApart(section, models.logScales, constants.LOG_SCALE_PLANES, count),
    ),
    rotations: readSection(rotations, (section) => decodeRotations(section, models, count, header.rotationBits)),
    rest: readSection(shRest, (section) => (header.shDegree === 1 ? decodeShRest(section, count) : [])),
  };
  const codes = [...[...coded.logScales, ...coded.opacity].map(checkCodes), ...coded.dc, ...coded.rest.map(checkCodes)];
  const { ids, positions, rotations: turned } = coded;
  return newScene({ ids, positions, rotations: turned, codes }, header, constants.RECENCY_LIMIT);
}

/** Each section has its own words, and ends by itself. */
function readSection<Result>(words: Words, decode: (section: Section) => Result): Result {
  const section = new Section(words);
  const result = decode(section);
  section.finish();
  return result;
}

function decodePositions(section: Section, chunk: CanonicalChunk, positionStep: number): Int32Array[] {
  const limit = 1n << BigInt(3 * chunk.axisBits);
  const models = sequenceModels(constants.KEY_CLASS_BITS);
  const keys = decodeAscending(section, models, chunk.gaussianCount, limit, "symbol-range");
  return chunk.origin.map((origin, axis) =>
    tabulate(keys.length, (i) => checkPosition(positionStep * (coordinateOfKey(keys[i], axis) + origin))),
  );
}

/** Nine rows; what the rows before hold of a Gaussian is the context of its number in the next. */
function decodeShRest(section: Section, count: number): Int32Array[] {
  const classes = constants.REST_CLASSES;
  const models = sequenceModels(constants.CLASS_BITS, classes * constants.SH_REST_PLANES);
  const sums = new Int32Array(count);
  return Array.from({ length: constants.SH_REST_PLANES }, (_, row) => {
    const outer = sums.map((before) => classes * row + Math.min(bitLength(before), classes - 1));
    const numbers = decodeSigned(section, models, count, outer);
    numbers.forEach((number, i) => {
      sums[i] += Math.abs(number);
    });
    return numbers;
  });
}
