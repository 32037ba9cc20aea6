"""Constants of the format, which are the same for all streams: SPEC 3.

The parameters of a stream are in `records.StreamHeader`; the settings of the encoder are in
`quarc_ref.encoder.settings.config`.
"""

from typing import Final, NamedTuple

# SPEC 3.1: version
VERSION_MAJOR: Final = 1
VERSION_MINOR: Final = 1

# SPEC 5.1, 5.2: container
MAGIC: Final = b"\x89QRC\r\n\x1a\n"
SYNC: Final = b"\x9eQC\xf3"
CHUNK_HEADER_BYTES: Final = 20
CHUNK_CRC_BYTES: Final = 4
HEAD_BYTES_LIMIT: Final = 1024
TAIL_BYTES: Final = 16
FEATURE_UPDATES: Final = 1 << 1
FEATURE_SNAPSHOTS: Final = 1 << 2
KNOWN_INCOMPATIBLE_FEATURES: Final = FEATURE_UPDATES | FEATURE_SNAPSHOTS
SECTION_HEADER_BYTES: Final = 4
CANONICAL_SECTIONS: Final = 6
LATTICE_EXPONENT_LIMIT: Final = 24
ROTATION_UNITY_LIMIT: Final = 256
ROTATION_BITS_LIMIT: Final = 14
STEP_LIMIT: Final = 1024

# SPEC 6: anchors
LATTICE_BITS: Final = 24
POSITION_LIMIT: Final = (1 << 23) - 1
LATTICE_OFFSET: Final = 1 << 23
LEVEL_COUNT_LIMIT: Final = 3
PHILOX_ROUNDS: Final = 10
PHILOX_DOMAIN_SAMPLER: Final = 1

# SPEC 7: state
ROTATION_FRACTION_BITS: Final = 22
ROTATION_ONE: Final = 1 << ROTATION_FRACTION_BITS
SUM_GUARD_BITS: Final = 20
PRODUCT_GUARD_BITS: Final = 8
COUNTER_LIMIT: Final = (1 << 32) - 1
CODE_LIMIT: Final = (1 << 15) - 1
RECENCY_LIMIT: Final = 3

# SPEC 8: entropy coding
WEIGHT_BITS: Final = 24
WEIGHT_TOTAL: Final = 1 << WEIGHT_BITS
WORD_BITS: Final = 32
PROBABILITY_CODES: Final = 240
CODE_BITS: Final = 8
STATED_WEIGHT: Final = 1 << 18
COUNT_LIMIT: Final = 1 << 12
MAGNITUDE_PLANES: Final = 64
SYMBOL_LIMIT: Final = MAGNITUDE_PLANES + 1
AXIS_BITS_LIMIT: Final = 20
CLASS_BITS: Final = 4
KEY_CLASS_BITS: Final = 6
MODELLED_BITS: Final = 2
REST_CLASSES: Final = 8
ROTATION_INDEX_BITS: Final = 2
RESIDUAL_ROWS: Final = 13
SURVIVOR_ROWS: Final = 14

# SPEC 10.2: factors of the spherical harmonics of degree 0 and 1
SH_C0: Final = 0.28209479177387814
SH_C1: Final = 0.4886025119029199

# SPEC 10.3: a Gaussian is not drawn if its depth is below this fraction of a camera's `near`
NEAR_FRACTION: Final = 0.8
# SPEC 10.3: variance of the low-pass filter of pictures, pixels
LOW_PASS: Final = 0.3

# SPEC 5.3: number of codes of a Gaussian, by attribute
LOG_SCALE_PLANES: Final = 3
OPACITY_PLANES: Final = 1
SH_DC_PLANES: Final = 3
SH_REST_PLANES: Final = 9


class Level(NamedTuple):
    """Limits of a conformance level (SPEC 3.2)."""

    gaussians: int
    births: int
    chunk_bytes: int


UNLIMITED: Final = (1 << 32) - 1
LEVELS: Final = {
    10: Level(gaussians=1 << 16, births=1 << 12, chunk_bytes=1 << 22),
    20: Level(gaussians=1 << 18, births=1 << 14, chunk_bytes=1 << 24),
    30: Level(gaussians=1 << 20, births=1 << 16, chunk_bytes=1 << 26),
    31: Level(gaussians=UNLIMITED, births=UNLIMITED, chunk_bytes=UNLIMITED),
}
