/** HEAD: the parameters of the stream (SPEC 5.3, 12). */

import * as constants from "./constants.js";
import { Fields } from "./fields.js";
import { demand } from "./reject.js";

export interface StreamHeader {
  readonly versionMinor: number;
  /** FEATURE_UPDATES: frames may have updates (7.8). */
  readonly updates: boolean;
  /** FEATURE_SNAPSHOTS: canonical frames may be snapshots (7.9). */
  readonly snapshots: boolean;
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
  fields.end();
  return header;
}

/** The channels of motion: translation x, y, z, rotation w if present, rotation x, y, z. */
export function channelCount(header: StreamHeader): number {
  return 3 + header.rotationComponents;
}

/** Checked at once, because fields of an unknown version or feature must not be read. */
function parseVersion(fields: Fields) {
  const major = fields.u8("version_major");
  demand(major === constants.VERSION_MAJOR, "unsupported-version", `version ${major}`);
  const versionMinor = fields.u8("version_minor");
  const features = fields.u32("incompatible_features");
  const unknown = features & ~constants.KNOWN_INCOMPATIBLE_FEATURES;
  demand(unknown === 0, "unsupported-feature", `unknown bits of incompatible_features: ${unknown >>> 0}`);
  const updates = (features & constants.FEATURE_UPDATES) !== 0;
  const snapshots = (features & constants.FEATURE_SNAPSHOTS) !== 0;
  return { versionMinor, updates, snapshots, compatibleFeatures: fields.u32("compatible_features") };
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
    logScaleStep: fields.positive("log_scale_step", constants.STEP_LIMIT),
    opacityStep: fields.positive("opacity_step", constants.STEP_LIMIT),
    shDcStep: fields.positive("sh_dc_step", constants.STEP_LIMIT),
    shRestStep: fields.positive("sh_rest_step", constants.STEP_LIMIT),
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
    metersPerUnit: fields.finite("meters_per_unit", 0, constants.METERS_PER_UNIT_LIMIT),
    colorSpace: fields.u8("color_space", 1, 1),
  };
}
