/** Decodes CANO, a canonical frame that is coded independently (SPEC 5.4, 7.2, 8.5). */

import {
  AttributeModels,
  checkPosition,
  sumContexts,
  decodeRotations,
  decodeRowsByContext,
  decodeShDc,
  expandRotations,
  checkCodes,
} from "./attributes.js";
import type { CodedRotations } from "./attributes.js";
import { allIndices, tabulate } from "./columns.js";
import * as constants from "./constants.js";
import { Fields } from "./fields.js";
import type { Words } from "./fields.js";
import type { StreamHeader } from "./header.js";
import { decodeAscending, decodeSigned, makeSequenceModels } from "./integers.js";
import { extractCoordinate } from "./morton.js";
import { Section } from "./planes.js";
import { makeScene } from "./scene.js";
import type { Scene } from "./scene.js";

/** The bounding box of coded positions, in position steps. */
export interface PositionBox {
  readonly origin: readonly number[];
  readonly axisBits: number;
}

export interface CanonicalChunk extends PositionBox {
  readonly frame: number;
  readonly gaussianCount: number;
  readonly sections: readonly Words[];
  readonly stateCrc: number;
}

/** The Gaussians of a canonical frame, in order. */
export interface CanonicalGaussians {
  /** x, y, z, in position steps. */
  readonly positions: readonly Int32Array[];
  /** Rotations as they are coded. */
  readonly codedRotations: CodedRotations;
  /** The same rotations as w, x, y, z, with 22 fraction bits. */
  readonly rotations: readonly Int32Array[];
  readonly codes: readonly Int32Array[];
}

export function parseCanonical(payload: Uint8Array): CanonicalChunk {
  const fields = new Fields(payload);
  const chunk = {
    frame: fields.u32("frame"),
    gaussianCount: fields.u32("gaussian_count"),
    ...parseBox(fields),
    sections: parseSections(fields),
    stateCrc: fields.u32("state_crc"),
  };
  fields.finish();
  return chunk;
}

/** Parse the fields of the bounding box. */
export function parseBox(fields: Fields): PositionBox {
  return {
    origin: ["x", "y", "z"].map((axis) => fields.i32(`origin ${axis}`)),
    axisBits: fields.u8("axis_bits", 0, constants.AXIS_BITS_LIMIT),
  };
}

/** Parse the sections of independently coded Gaussians. */
export function parseSections(fields: Fields): Words[] {
  return Array.from({ length: constants.CANONICAL_SECTIONS }, (_, i) => fields.words(`sections[${i}]`));
}

/** Decode `count` independently coded Gaussians (8.5). The caller has checked the count against the level. */
export function decodeGaussians(
  sections: readonly Words[],
  count: number,
  box: PositionBox,
  header: StreamHeader,
): CanonicalGaussians {
  const models = new AttributeModels();
  const [keys, shDc, opacity, logScales, rotations, shRest] = sections;
  const attributes = {
    positions: readSection(keys, (section) => decodePositions(section, count, box, header.positionStep)),
    dc: readSection(shDc, (section) => decodeShDc(section, models, count)),
    opacity: readSection(opacity, (section) =>
      decodeRowsByContext(section, models.opacity, constants.OPACITY_PLANES, count),
    ),
    logScales: readSection(logScales, (section) =>
      decodeRowsByContext(section, models.logScales, constants.LOG_SCALE_PLANES, count),
    ),
    ...readSection(rotations, (section) => {
      const codedRotations = decodeRotations(section, models, count);
      return { coded: codedRotations, rotations: expandRotations(codedRotations, header.rotationBits) };
    }),
    rest: readSection(shRest, (section) => (header.shDegree === 1 ? decodeShRest(section, count) : [])),
  };
  const { positions, dc, coded: codedRotations, rotations: expandedRotations } = attributes;
  const codes = [
    ...[...attributes.logScales, ...attributes.opacity].map(checkCodes),
    ...dc,
    ...attributes.rest.map(checkCodes),
  ];
  return { positions, codedRotations, rotations: expandedRotations, codes };
}

/** Make the scene of a canonical frame, where Gaussian i has id i. */
export function makeCanonicalScene(gaussians: CanonicalGaussians, header: StreamHeader): Scene {
  const { rotations, codes } = gaussians;
  const positions = gaussians.positions.map((row) => row.map((coordinate) => header.positionStep * coordinate));
  const ids = allIndices(positions[0].length);
  return makeScene({ ids, positions, rotations, codes }, header, constants.RECENCY_LIMIT);
}

/** Check that a coordinate in position steps is in the range of positions, and return it. */
export function checkStepCoordinate(coordinate: number, positionStep: number): number {
  checkPosition(positionStep * coordinate);
  return coordinate;
}

/** Decode a section, and check that all of its words are used. */
export function readSection<Result>(words: Words, decode: (section: Section) => Result): Result {
  const section = new Section(words);
  const result = decode(section);
  section.finish();
  return result;
}

function decodePositions(section: Section, count: number, box: PositionBox, positionStep: number): Int32Array[] {
  const limit = 1n << BigInt(3 * box.axisBits);
  const models = makeSequenceModels(constants.KEY_CLASS_BITS);
  const keys = decodeAscending(section, models, count, limit, "symbol-range");
  return box.origin.map((origin, axis) =>
    tabulate(keys.length, (i) => checkStepCoordinate(extractCoordinate(keys[i], axis) + origin, positionStep)),
  );
}

/** Decode nine rows; the context of a number depends on the preceding rows of the same Gaussian. */
function decodeShRest(section: Section, count: number): Int32Array[] {
  const models = makeSequenceModels(constants.CLASS_BITS, constants.REST_CLASSES * constants.SH_REST_PLANES);
  const sums = new Int32Array(count);
  return Array.from({ length: constants.SH_REST_PLANES }, (_, row) => {
    const numbers = decodeSigned(section, models, count, sumContexts(row, sums));
    numbers.forEach((number, i) => {
      sums[i] += Math.abs(number);
    });
    return numbers;
  });
}
