import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.entropy import encode_bits
from quarc_ref.format.coding.planes import PlaneReader, PlaneWriter
from quarc_ref.format.constants import STATED_WEIGHT, WEIGHT_TOTAL
from quarc_ref.format.errors import BadProbabilityError, UnconsumedWordsError
from quarc_ref.format.records import Section

_PLANES = st.lists(
    st.lists(st.tuples(st.integers(0, 5), st.booleans()), min_size=1, max_size=90).map(np.array),
    max_size=5,
)


def _write(planes, counts):
    writer = PlaneWriter(counts)
    for plane in planes:
        writer.code("some", plane[:, 0], plane[:, 1].astype(bool))
    return writer.section()


def _read(section, planes, counts):
    reader = PlaneReader(section, counts)
    placeholders = [np.zeros(plane.shape[0], dtype=bool) for plane in planes]
    decoded = [
        reader.code("some", plane[:, 0], bits).tolist()
        for plane, bits in zip(planes, placeholders, strict=True)
    ]
    return decoded, reader.finish()


def _constant(bit, count):
    return np.stack([np.zeros(count, dtype=int), np.full(count, bit)], axis=1)


@given(_PLANES, _PLANES)
def test_a_reader_returns_the_bits_of_the_writer(first, second):
    counts = ContextCounts()
    for planes in (first, second):
        decoded, counts = _read(_write(planes, counts), planes, counts)
        assert decoded == [plane[:, 1].astype(bool).tolist() for plane in planes]


def test_adapted_contexts_make_the_same_bits_cheaper():
    rng = np.random.default_rng(0)
    plane = np.stack([rng.integers(0, 9, 900), rng.random(900) < 0.02], axis=1).astype(int)
    _, counts = _read(_write([plane], ContextCounts()), [plane], ContextCounts())

    first_size, second_size = (
        _write([plane], initial_counts).byte_count() for initial_counts in (ContextCounts(), counts)
    )

    assert second_size < first_size


def test_a_context_that_changes_states_its_probability():
    ones, counts = [_constant(1, 4000)], ContextCounts()
    _, counts = _read(_write([_constant(0, 4000)], counts), [_constant(0, 4000)], counts)

    section = _write(ones, counts)

    assert section.byte_count() < 16  # 6 KB without a stated probability
    assert _read(section, ones, counts)[0] == [[True] * 4000]


def test_planes_of_one_section_learn_from_each_other():
    planes = [_constant(0, 200), np.zeros((1, 2), dtype=int)]

    _, counts = _read(_write(planes, ContextCounts()), planes, ContextCounts())

    assert counts.compute_weights("some", np.array([0])).tolist() == [WEIGHT_TOTAL // 404]


def test_a_stated_code_that_is_undefined_is_rejected():
    code = np.array([1, 1, 1, 1, 0, 0, 0, 0], dtype=bool)
    runs = [(np.array([True]), STATED_WEIGHT), (code, WEIGHT_TOTAL // 2)]
    reader = PlaneReader(Section(encode_bits(runs)), ContextCounts())

    with pytest.raises(BadProbabilityError, match="240"):
        reader.code("some", np.array([0]), np.zeros(1, dtype=bool))


def test_unread_planes_are_rejected():
    rng = np.random.default_rng(0)
    section = _write(
        [np.stack([np.zeros(400), rng.integers(0, 2, 400)], axis=1).astype(int)], ContextCounts()
    )
    reader = PlaneReader(section, ContextCounts())
    reader.code("some", np.zeros(10, dtype=int), np.zeros(10, dtype=bool))

    with pytest.raises(UnconsumedWordsError):
        reader.finish()


def test_raw_bits_cost_one_bit_each_and_adapt_nothing():
    writer = PlaneWriter(ContextCounts())
    bits = np.arange(64) % 3 == 0
    writer.code_raw(bits)
    section = writer.section()
    reader = PlaneReader(section, ContextCounts())

    assert section.words.size == 3
    assert reader.code_raw(np.zeros(64, dtype=bool)).tolist() == bits.tolist()
    assert reader.finish().compute_weights("some", np.array([0])).tolist() == [WEIGHT_TOTAL // 2]


def test_a_plane_without_elements_costs_nothing():
    writer = PlaneWriter(ContextCounts())
    no_elements = np.zeros(0, dtype=int)
    writer.code("some", no_elements, no_elements.astype(bool))

    assert writer.section().words.size == 0
