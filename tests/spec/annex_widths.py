"""The bounds of Annex E, computed from the constants and the ranges of the header fields."""

from collections.abc import Iterator
from math import isqrt

from quarc_ref.format import constants as c
from tests.spec.annex_vectors import render_table

U16, U32, U64 = (1 << 16) - 1, (1 << 32) - 1, (1 << 64) - 1
MOTION = c.LEVEL_COUNT_LIMIT * c.SYMBOL_LIMIT
DONE = (c.LEVEL_COUNT_LIMIT - 1) * c.SYMBOL_LIMIT
EXPECTED = MOTION + DONE
BIASED = 2 * c.POSITION_LIMIT
SIGNED_LIMIT = (1 << ((1 << c.CLASS_BITS) - 1)) - 1
KEY_LIMIT = (1 << ((1 << c.KEY_CLASS_BITS) - 1)) - 1
MIN_SUM = c.LEVEL_COUNT_LIMIT - MOTION
MAX_SUM = c.LEVEL_COUNT_LIMIT * c.ROTATION_UNITY_LIMIT + MOTION
SUM_SQUARE = MAX_SUM**2 + 3 * MOTION**2
# A unit quaternion rounded to Q22: its norm exceeds 2^22 by less than 2 with 8 guard bits, and by
# less than 6 with 20 guard bits and a short vector; a rounded product of both by 10.
PRODUCT = c.ROTATION_ONE + 10
PRODUCT_SUM = (c.ROTATION_ONE + 2) * (c.ROTATION_ONE + 6)
# The largest planes have a bit for each row of SH rest of every newborn.
MAX_COUNTED = c.COUNT_LIMIT + U32 * c.SH_REST_PLANES
MAX_NUMERATOR = (2 * c.COUNT_LIMIT + 1) * c.WEIGHT_TOTAL
MIN_BY_COUNTS = c.WEIGHT_TOTAL // (2 * c.COUNT_LIMIT + 2)
MAX_BY_COUNTS = MAX_NUMERATOR // (2 * c.COUNT_LIMIT + 2)

Bound = tuple[str, int, int, str]


def bounds() -> list[Bound]:
    """Return name, minimum, maximum and section of all integers that a decoder computes."""
    return [
        *_field_bounds(),
        *_anchor_bounds(),
        *_frame_bounds(),
        *_rotation_bounds(),
        *_plane_bounds(),
    ]


def _field_bounds() -> Iterator[Bound]:
    yield "bytes of a payload; any CRC; any ordinal, phase or count", 0, U32, "5"
    yield "bytes of a serialization", 8 + 60, 8 + 96 * U32, "9.1"
    yield "`origin`, each axis", -(1 << 31), (1 << 31) - 1, "5.4"
    yield "position minus the origin, each axis", 0, (1 << c.AXIS_BITS_LIMIT) - 1, "5.4"
    yield "id of a Gaussian", 0, U32, "7.1"
    yield "id of the next newborn Gaussian", 1, 1 << 32, "7.1"
    yield "this id + `birth_count`", 1, (1 << 32) + U32, "7.6"
    yield "N - deaths + births - Gaussians that updates delete", 1, 2 * U32, "7.6"
    yield "survivors + `newborn_count`", 0, 2 * U32, "7.9"
    yield "ordinal + 1, phase + 1, sequence + 1", 1, 1 << 32, "7.4"
    yield "`seed`", 0, U64, "5.3"
    yield "24 + `length`: bytes of a chunk", 24, 24 + U32, "5.2"
    yield "4 x `word_count`", 0, 4 * U32, "8.1"
    yield "`index_offset`, `offset` of a seek point", 0, U64, "5.9"


def _anchor_bounds() -> Iterator[Bound]:
    yield "A_l", 1, U32, "6.1"
    yield "product of a round of Philox", 0, U32 * 0xD2511F53, "6.2"
    yield "rank: word x 2^32 + id", 0, U64, "6.2"
    yield "position + LATTICE_OFFSET", 1, BIASED + 1, "6.3"
    yield "difference of two positions, each axis", -BIASED, BIASED, "6.4"
    yield "squared distance", 0, 3 * BIASED**2, "6.4"


def _frame_bounds() -> Iterator[Bound]:
    canonical = (1 << 31) * U16
    max_coded = ((1 << 31) - 1 + (1 << c.AXIS_BITS_LIMIT) - 1) * U16
    moved_limit = c.POSITION_LIMIT + MOTION * U16
    two_codes, three_codes = 2 * SIGNED_LIMIT, 3 * SIGNED_LIMIT
    newborn_limit = c.POSITION_LIMIT + SIGNED_LIMIT * U16
    yield "canonical position before its check", -canonical, max_coded, "7.2"
    yield "moved position before its check", -moved_limit, moved_limit, "7.5"
    yield "newborn or updated position before its check", -newborn_limit, newborn_limit, "7.6"
    yield "position of the state", -c.POSITION_LIMIT, c.POSITION_LIMIT, "7.1"
    yield "symbol", -c.SYMBOL_LIMIT, c.SYMBOL_LIMIT, "8.7"
    yield "motion, each channel", -MOTION, MOTION, "7.1"
    yield "motion done, each channel", -DONE, DONE, "8.7"
    yield "expected value, each channel; f", -EXPECTED, EXPECTED, "8.7"
    yield "sum of the magnitudes of a parent's symbols", 0, 7 * c.SYMBOL_LIMIT, "8.7"
    yield "sum of the magnitudes of the expected values", 0, 7 * EXPECTED, "8.7"
    yield "f - i", -EXPECTED - c.MAGNITUDE_PLANES + 1, EXPECTED, "8.7"
    yield "sum of 2 numbers: SH DC, log-scale y, before its check", -two_codes, two_codes, "8.5"
    yield (
        "sum of 3 numbers: log-scale z of a newborn Gaussian, before its check",
        -three_codes,
        three_codes,
        "8.6",
    )
    yield "updated code before its check", -two_codes, two_codes, "7.8"
    yield (
        "residual of rotation of an update",
        -c.ROTATION_UNITY_LIMIT,
        c.ROTATION_UNITY_LIMIT,
        "7.8",
    )
    yield "s: sum of residuals of an update", -two_codes, two_codes, "8.8"
    yield from _survivor_position_bounds()
    yield "code of a survivor before its check", -two_codes, two_codes, "7.9"
    component = (1 << c.ROTATION_BITS_LIMIT) + SIGNED_LIMIT
    yield "a, b, c of a survivor before their check", -component, component, "7.9"
    yield "s: sum of magnitudes of a survivor", 0, two_codes, "8.9"
    yield "code of the state", -c.CODE_LIMIT, c.CODE_LIMIT, "7.1"


def _survivor_position_bounds() -> Iterator[Bound]:
    difference = SIGNED_LIMIT * U32
    position = c.POSITION_LIMIT + difference
    max_newborn = (1 << 31) - 1 + (1 << c.AXIS_BITS_LIMIT) - 1
    lattice = c.POSITION_LIMIT + difference * U16
    yield "difference of a position of a survivor", -difference, difference, "8.9"
    yield "position of a survivor before its checks, position steps", -position, position, "7.9"
    yield "this position x `position_step`", -lattice, lattice, "7.9"
    yield (
        "difference of two positions of a snapshot, before its check",
        0,
        position + max_newborn,
        "7.9",
    )


def _rotation_bounds() -> Iterator[Bound]:
    one, numerator = c.ROTATION_ONE, c.ROTATION_FRACTION_BITS + c.SUM_GUARD_BITS
    doubled = 2 * (MAX_SUM << numerator) + isqrt(SUM_SQUARE << (2 * c.SUM_GUARD_BITS))
    squared = PRODUCT**2 << (2 * c.PRODUCT_GUARD_BITS)
    scaled = PRODUCT << (c.ROTATION_FRACTION_BITS + c.PRODUCT_GUARD_BITS)
    yield "a u, b u, c u", -one, one, "7.2"
    yield "v, of an expanded rotation", -2 * one**2, one**2, "7.2"
    yield "component of a rotation of the state", -one, one, "7.1"
    yield "L x `rotation_unity` + W'", MIN_SUM, MAX_SUM, "7.5"
    yield "sum of squares of (L x `rotation_unity` + W', X, Y, Z)", 0, SUM_SQUARE, "7.3"
    yield "this sum x 2^40", 0, SUM_SQUARE << (2 * c.SUM_GUARD_BITS), "7.3"
    yield "v_i x 2^42", -(MOTION << numerator), MAX_SUM << numerator, "7.3"
    yield "2 abs(v_i x 2^42) + n", 0, doubled, "4.2"
    yield "partial sums of a component of q x d", -4 * one**2, 4 * one**2, "7.5"
    yield "component of q x d before division", -PRODUCT_SUM, PRODUCT_SUM, "7.5"
    yield "2 abs(component of q x d before division) + 2^22", one, 2 * PRODUCT_SUM + one, "4.2"
    yield "component of q x d after division", -PRODUCT, PRODUCT, "7.5"
    yield "sum of squares of q x d, x 2^16", 1 << 16, squared, "7.3"
    yield "v_i x 2^30, of 7.2 and of q x d", -scaled, scaled, "7.3"
    yield "2 abs(v_i x 2^30) + n", 0, 2 * scaled + isqrt(squared), "4.2"


def _plane_bounds() -> Iterator[Bound]:
    yield "bits of a plane", 0, U32 * c.SH_REST_PLANES, "8.1"
    yield "zeros, ones, zeros + ones, between planes", 0, c.COUNT_LIMIT, "8.2"
    yield "these counts, before they are halved", 0, MAX_COUNTED, "8.2"
    yield "2 (zeros + ones) + 2", 2, 2 * c.COUNT_LIMIT + 2, "8.2"
    yield "(2 ones + 1) x 2^24", c.WEIGHT_TOTAL, MAX_NUMERATOR, "8.2"
    yield "weight of a 1, from counts", MIN_BY_COUNTS, MAX_BY_COUNTS, "8.2"
    yield "weight of a 1, from a code", 256, c.WEIGHT_TOTAL - 256, "8.2"
    yield "state of the coder", 0, U64, "8.3"
    yield "class coded by Unsigned(KEY_CLASS_BITS)", 0, (1 << c.KEY_CLASS_BITS) - 1, "8.4"
    yield "number coded by Unsigned(KEY_CLASS_BITS)", 0, KEY_LIMIT, "8.4"
    yield "number coded by Signed(CLASS_BITS)", -SIGNED_LIMIT, SIGNED_LIMIT, "8.4"
    yield "difference of ascending numbers", 0, 1 << 60, "8.4"
    yield "sum of differences, where a decoder stops above 2^61", 0, (1 << 61) + (1 << 60), "8.4"
    yield "Morton key", 0, (1 << (3 * c.AXIS_BITS_LIMIT)) - 1, "8.5"
    yield "s: sum of magnitudes of SH rest", 0, (c.SH_REST_PLANES - 1) * SIGNED_LIMIT, "8.5"
    yield "context of a plane", 0, _max_context(), "8.4"


def _max_context() -> int:
    """Return the largest context, which is a mantissa context of the survivors' last row."""
    outer = c.REST_CLASSES * max(c.SH_REST_PLANES, c.SURVIVOR_ROWS) - 1
    inner = (outer << c.CLASS_BITS) + (1 << c.CLASS_BITS) - 1
    return ((2 * inner + 1) << c.MODELLED_BITS) + (1 << c.MODELLED_BITS) - 1


def bit_width(minimum: int, maximum: int) -> str:
    """Return a width such as `u24` (24 bits, unsigned) or `i25` (25 bits, two's complement)."""
    if minimum >= 0:
        return f"u{max(1, maximum.bit_length())}"
    return f"i{max(maximum, -minimum - 1).bit_length() + 1}"


def widths() -> str:
    rows = [
        (name, str(minimum), str(maximum), bit_width(minimum, maximum), section)
        for name, minimum, maximum, section in bounds()
    ]
    head = ("quantity", "least", "greatest", "bits", "section")
    return "<!-- spec:widths -->\n" + render_table(head, rows)
