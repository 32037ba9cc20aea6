/** The constants of SPEC 3.1 and 3.2. Numbers that have no name in SPEC have no name in the code. */

export const VERSION_MAJOR = 1;
export const FEATURE_UPDATES = 2;
export const FEATURE_SNAPSHOTS = 4;
export const KNOWN_INCOMPATIBLE_FEATURES = FEATURE_UPDATES | FEATURE_SNAPSHOTS;

export const CHUNK_HEADER_BYTES = 20;
export const CHUNK_CRC_BYTES = 4;
export const HEAD_BYTES_LIMIT = 1024;
export const TAIL_BYTES = 16;
export const CANONICAL_SECTIONS = 6;

export const LATTICE_EXPONENT_LIMIT = 24;
export const ROTATION_UNITY_LIMIT = 256;
export const ROTATION_BITS_LIMIT = 14;
export const STEP_LIMIT = 1024;
export const LEVEL_COUNT_LIMIT = 3;
export const AXIS_BITS_LIMIT = 20;
export const METERS_PER_UNIT_LIMIT = 1_000_000;

export const LATTICE_BITS = 24;
export const LATTICE_OFFSET = 8388608;
export const POSITION_LIMIT = 8388607;
export const COUNTER_LIMIT = 4294967295;
export const CODE_LIMIT = 32767;
export const RECENCY_LIMIT = 3;
/** Maximum magnitude of a rotation residual (SPEC 7.8). */
export const TURN_LIMIT = 256;

export const PHILOX_ROUNDS = 10;
export const PHILOX_DOMAIN_SAMPLER = 1;

export const ROTATION_FRACTION_BITS = 22;
export const ROTATION_ONE = 4194304;
export const SUM_GUARD_BITS = 20;
export const PRODUCT_GUARD_BITS = 8;

export const WEIGHT_TOTAL = 16777216;
export const HALF_WEIGHT = WEIGHT_TOTAL / 2;
export const STATED_WEIGHT = 262144;
export const PROBABILITY_CODES = 240;
export const CODE_BITS = 8;
export const COUNT_LIMIT = 4096;

export const CLASS_BITS = 4;
export const KEY_CLASS_BITS = 6;
export const MODELLED_BITS = 2;
export const REST_CLASSES = 8;
export const ROTATION_INDEX_BITS = 2;
export const RESIDUAL_ROWS = 13;
export const SURVIVOR_ROWS = 14;
export const MAGNITUDE_PLANES = 64;
export const DIFFERENCE_LIMIT = 1n << 60n;

export const LOG_SCALE_PLANES = 3;
export const OPACITY_PLANES = 1;
export const SH_DC_PLANES = 3;
export const SH_REST_PLANES = 9;

/** The limits of a level (SPEC 3.2). */
export interface LevelLimits {
  readonly gaussians: number;
  readonly births: number;
  readonly payloadBytes: number;
}

export const UNLIMITED_LEVEL = 31;

export const LEVELS: ReadonlyMap<number, LevelLimits> = new Map([
  [10, { gaussians: 65536, births: 4096, payloadBytes: 4194304 }],
  [20, { gaussians: 262144, births: 16384, payloadBytes: 16777216 }],
  [30, { gaussians: 1048576, births: 65536, payloadBytes: 67108864 }],
  [UNLIMITED_LEVEL, { gaussians: 4294967295, births: 4294967295, payloadBytes: 4294967295 }],
]);

/** The limits of this decoder for streams at the unlimited level; it declines streams that exceed them (SPEC 3.2). */
export const OWN_LIMITS: LevelLimits = { gaussians: 4194304, births: 4194304, payloadBytes: 268435456 };
