"""The arithmetic stays within the bounds of Annex E, and extreme inputs reach them."""

import re
from math import isqrt

from hypothesis import given
from hypothesis import strategies as st

from plain import oracle, spec_text
from plain.coder import add_to_counts, weight_from_counts
from quarc_ref.format import constants as c
from tests.spec import annex_widths

BOUNDS = {name: (least, greatest) for name, least, greatest, _ in annex_widths.bounds()}
ONE = 1 << 22


def _is_within(name: str, *values: int) -> bool:
    minimum, maximum = BOUNDS[name]
    return all(minimum <= value <= maximum for value in values)


@st.composite
def sums(draw) -> list[int]:
    """Draw possible sums of the symbols of up to three levels, not all 0."""
    levels, unity = draw(st.integers(1, 3)), draw(st.sampled_from([1, 2, 100, 255, 256]))
    limit = 65 * levels
    component = st.one_of(st.sampled_from([-limit, -1, 0, 1, limit]), st.integers(-limit, limit))
    vector = [levels * unity + draw(component), draw(component), draw(component), draw(component)]
    return vector if any(vector) else [1, 0, 0, 0]


@st.composite
def rotations(draw) -> list[int]:
    """Draw possible rotations of a state: expanded from codes, and possibly rotated."""
    bits = draw(st.integers(1, 14))
    components = [0, 0, 0]
    for index in draw(st.permutations(range(3))):
        remainder = isqrt((1 << (2 * bits)) - sum(v * v for v in components))
        components[index] = draw(
            st.one_of(
                st.sampled_from([-remainder, 0, remainder]), st.integers(-remainder, remainder)
            )
        )
    rotation = oracle.expand_rotation(draw(st.integers(0, 3)), components, bits)
    return oracle.rotate(rotation, draw(sums())) if draw(st.booleans()) else rotation


@given(rotations(), sums())
def test_a_rotation_of_one_step_stays_within_the_widths(rotation, vector):
    squared = sum(v * v for v in vector)
    residual = oracle.normalize(vector, 20)
    products = oracle.multiply_quaternions(rotation, residual)
    divided = [oracle.divide_round(v, ONE) for v in products]

    assert _is_within("L x `rotation_unity` + W'", vector[0])
    assert _is_within("this sum x 2^40", squared << 40)
    assert _is_within("v_i x 2^42", *(v << 42 for v in vector))
    assert _is_within(
        "2 abs(v_i x 2^42) + n", *(2 * abs(v << 42) + isqrt(squared << 40) for v in vector)
    )
    assert _is_within("component of q x d before division", *products)
    assert _is_within("component of q x d after division", *divided)
    assert _is_within(
        "2 abs(component of q x d before division) + 2^22", *(2 * abs(v) + ONE for v in products)
    )
    norm = isqrt(sum(v * v for v in divided) << 16)
    assert _is_within("sum of squares of q x d, x 2^16", sum(v * v for v in divided) << 16)
    assert _is_within("v_i x 2^30, of 7.2 and of q x d", *(v << 30 for v in divided))
    assert _is_within("2 abs(v_i x 2^30) + n", *(2 * abs(v << 30) + norm for v in divided))
    for unit in (rotation, residual, oracle.normalize(divided, 8)):
        assert _is_within("component of a rotation of the state", *unit)


@given(st.integers(0, 4096), st.integers(0, 4096), st.integers(0, 20000), st.integers(0, 20000))
def test_counts_and_their_weights_stay_within_the_widths(count_before, ones_before, zeros, ones):
    counts = [count_before - min(ones_before, count_before), min(ones_before, count_before)]

    counts_after = add_to_counts(counts, [0] * zeros + [1] * ones)

    assert _is_within("zeros, ones, zeros + ones, between planes", *counts_after, sum(counts_after))
    assert _is_within("weight of a 1, from counts", weight_from_counts(*counts_after))


def test_the_widths_of_counts_are_reached():
    minimum, maximum = BOUNDS["weight of a 1, from counts"]

    assert (weight_from_counts(4096, 0), weight_from_counts(0, 4096)) == (minimum, maximum)
    assert BOUNDS["(2 ones + 1) x 2^24"][1] == (2 * 4096 + 1) << 24
    assert BOUNDS["motion done, each channel"] == (-130, 130)
    assert BOUNDS["expected value, each channel; f"] == (-325, 325)
    assert BOUNDS["f - i"] == (-388, 325)


def test_the_widths_are_reached():
    """A bound that no input reaches would be too wide, so extreme inputs must reach the bounds."""
    largest_sums = [963, 195, 195, 195]

    assert sum(v * v for v in largest_sums) << 40 == BOUNDS["this sum x 2^40"][1]
    assert BOUNDS["v_i x 2^42"] == (-195 << 42, 963 << 42)
    assert BOUNDS["v_i x 2^30, of 7.2 and of q x d"][1] > ONE << 30
    assert BOUNDS["2 abs(v_i x 2^30) + n"][1] > 1 << 53
    assert BOUNDS["L x `rotation_unity` + W'"] == (3 * 1 - 195, 3 * 256 + 195)
    assert BOUNDS["squared distance"][1] == 3 * (2 * 8388607) ** 2
    assert BOUNDS["product of a round of Philox"][1] == 0xFFFFFFFF * 0xD2511F53
    assert BOUNDS["state of the coder"][1] == (1 << 64) - 1
    last_survivor = 8388607 + 65535 * (32767 * 0xFFFFFFFF)
    assert BOUNDS["this position x `position_step`"] == (-last_survivor, last_survivor)


def test_all_bounds_fit_int64_except_the_unsigned_quantities():
    unsigned_only = {name for name, (_, greatest) in BOUNDS.items() if greatest >= 1 << 63}

    assert unsigned_only == {
        "product of a round of Philox",
        "rank: word x 2^32 + id",
        "state of the coder",
        "`seed`",
        "`index_offset`, `offset` of a seek point",
    }
    assert all(least >= -(1 << 63) for least, _ in BOUNDS.values())


def _count_contexts(class_bits: int, signs: int) -> int:
    """Return the number of contexts of a sequence for one outer context (SPEC 8.4)."""
    classes = (1 << class_bits) - 1  # as many as nodes and as signs: class 0 has no sign
    mantissas = (classes - 1) + 2 * (classes - 2)  # known is 1, then 2 or 3
    return classes + (classes + 2 * mantissas if signs else mantissas)


def test_the_numbers_of_contexts_of_section_13_follow_from_section_8():
    signed = _count_contexts(c.CLASS_BITS, signs=True)
    index = (1 << c.ROTATION_INDEX_BITS) - 1
    fields = 1 + 2 + 4 + 8 + 16
    level = 20 + (12 + 16 + 16) + 9 + 33  # translation is preceded by at most two channels
    motion = c.LEVEL_COUNT_LIMIT * level - 15  # P is 0 at the coarsest level
    births = _count_contexts(c.KEY_CLASS_BITS, signs=False) + 12 * signed + index
    updates = 16 + 4 + fields + (4 * (1 + 3 + 3) + 1) * signed
    sh_rest = (1 + 8 * c.REST_CLASSES) * signed
    survivors = 1 + fields + index + (4 * (1 + 2 * c.REST_CLASSES) + 1) * signed

    section = spec_text.read_spec().split("## 13 Security")[1]
    stated = [int(number) for number in re.findall(r"at\s+most\s+(\d{4})\b", section)]

    assert stated == [motion + births, updates, sh_rest, survivors]
