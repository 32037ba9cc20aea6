/** Parses HEAD, the parameters of the stream (SPEC 5.3, 12). */

import * as constants from "./constants.js";
import { Fields } from "./fields.js";
import { demand } from "./reject.js";

export interface StreamHeader {
  readonly versionMinor: number;
  /** Whether frames have a section of updates (FEATURE_UPDATES, 7.8). */
  readonly hasUpdates: boolean;
  /** Whether canonical frames may be snapshots (FEATURE_SNAPSHOTS, 7.9). */
  readonly hasSnapshots: boolean;
  readonly compatibleFeatures: number;
  readonly level: number;
  readonly limits: constants.LevelLimits;
  readonly timescale: number;
  readonly frameTicks: number;
  readonly latticeExponent: number;
  readonly positionStep: number;
  readonly translationStep: number;
  readonly rotationUnity: number;
  readonly rotationComponents: number;
  readonly rotationBits: number;
  readonly logScaleStep: number;
  readonly opacityStep: number;
  readonly shDcStep: number;
  readonly shRestStep: number;
  readonly shDegree: number;
  readonly levelCount: number;
  readonly gaussiansPerAnchor: number;
  readonly anchorRatio: number;
  readonly resampleInterval: number;
  readonly fullCrcInterval: number;
  readonly seed: bigint;
  readonly rightHanded: number;
  readonly upAxis: number;
  readonly metersPerUnit: number;
  readonly colorSpace: number;
}

export function parseHeader(payload: Uint8Array): StreamHeader {
  const fields = new Fields(payload);
  const header: StreamHeader = {
    ...parseVersion(fields),
    ...parseLevel(fields),
    ...parseSteps(fields),
    ...parseAnchors(fields),
    ...parseWorld(fields),
  };
  fields.finish();
  return header;
}

/** Number of channels of motion: translation x, y, z, then rotation x, y, z, with w before them if it is coded. */
export function channelCount(header: StreamHeader): number {
  return 3 + header.rotationComponents;
}

/** Version and features are checked at once, because the other fields of unknown versions must not be read. */
function parseVersion(fields: Fields) {
  const major = fields.u8("version_major");
  demand(major === constants.VERSION_MAJOR, "unsupported-version", `version ${major}`);
  const versionMinor = fields.u8("version_minor");
  const features = fields.u32("incompatible_features");
  const unknownFeatures = features & ~constants.KNOWN_INCOMPATIBLE_FEATURES;
  demand(
    unknownFeatures === 0,
    "unsupported-feature",
    `unknown bits of incompatible_features: ${unknownFeatures >>> 0}`,
  );
  const hasUpdates = (features & constants.FEATURE_UPDATES) !== 0;
  const hasSnapshots = (features & constants.FEATURE_SNAPSHOTS) !== 0;
  return { versionMinor, hasUpdates, hasSnapshots, compatibleFeatures: fields.u32("compatible_features") };
}

function parseLevel(fields: Fields) {
  const level = fields.u8("level");
  const limits = constants.LEVELS.get(level);
  demand(limits !== undefined, "field", `level ${level} is undefined`);
  return { level, limits, timescale: fields.u32("timescale", 1), frameTicks: fields.u32("frame_ticks", 1) };
}

function parseSteps(fields: Fields) {
  return {
    latticeExponent: fields.u8("lattice_exponent", 0, constants.LATTICE_EXPONENT_LIMIT),
    positionStep: fields.u16("position_step", 1),
    translationStep: fields.u16("translation_step", 1),
    rotationUnity: fields.u16("rotation_unity", 1, constants.ROTATION_UNITY_LIMIT),
    rotationComponents: fields.u8("rotation_components", 3, 4),
    rotationBits: fields.u8("rotation_bits", 1, constants.ROTATION_BITS_LIMIT),
    logScaleStep: fields.positiveFloat("log_scale_step", constants.STEP_LIMIT),
    opacityStep: fields.positiveFloat("opacity_step", constants.STEP_LIMIT),
    shDcStep: fields.positiveFloat("sh_dc_step", constants.STEP_LIMIT),
    shRestStep: fields.positiveFloat("sh_rest_step", constants.STEP_LIMIT),
    shDegree: fields.u8("sh_degree", 0, 1),
  };
}

function parseAnchors(fields: Fields) {
  return {
    levelCount: fields.u8("level_count", 1, constants.LEVEL_COUNT_LIMIT),
    gaussiansPerAnchor: fields.u16("gaussians_per_anchor", 1),
    anchorRatio: fields.u16("anchor_ratio", 2),
    resampleInterval: fields.u16("resample_interval", 1),
    fullCrcInterval: fields.u16("full_crc_interval", 1),
    seed: fields.u64("seed"),
  };
}

function parseWorld(fields: Fields) {
  return {
    rightHanded: fields.u8("right_handed", 0, 1),
    upAxis: fields.u8("up_axis", 0, 6),
    metersPerUnit: fields.finiteFloat("meters_per_unit", 0, constants.METERS_PER_UNIT_LIMIT),
    colorSpace: fields.u8("color_space", 1, 1),
  };
}
