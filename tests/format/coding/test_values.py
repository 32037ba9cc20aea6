import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.planes import PlaneReader, PlaneWriter
from quarc_ref.format.coding.values import code_fixed, code_signed, code_unsigned

_CLASS_BITS = 4
_MAXIMUM = (1 << 15) - 1


def _round_trip(walk, values):
    """Write values, and return the values that a reader decodes."""
    writer = PlaneWriter(ContextCounts())
    assert walk(writer, values).tolist() == values.tolist()
    reader = PlaneReader(writer.section(), ContextCounts())
    decoded = walk(reader, np.zeros_like(values))
    reader.finish()
    return decoded.tolist()


def _arrays(minimum, maximum):
    values = st.integers(minimum, maximum) | st.integers(max(minimum, -3), 3)
    return st.lists(values, max_size=40).map(lambda items: np.array(items, dtype=np.int64))


@given(_arrays(0, 31))
def test_numbers_of_fixed_width_survive_a_round_trip(values):
    contexts = np.arange(values.size) % 2
    walk = lambda planes, numbers: code_fixed(planes, "some", contexts, 5, numbers)  # noqa: E731

    assert _round_trip(walk, values) == values.tolist()


@given(_arrays(0, _MAXIMUM))
def test_unsigned_numbers_survive_a_round_trip(values):
    contexts = np.arange(values.size) % 3
    walk = lambda planes, numbers: code_unsigned(planes, "some", contexts, _CLASS_BITS, numbers)  # noqa: E731

    assert _round_trip(walk, values) == values.tolist()


@given(_arrays(-_MAXIMUM, _MAXIMUM))
def test_signed_numbers_survive_a_round_trip(values):
    contexts = np.arange(values.size) % 3
    walk = lambda planes, numbers: code_signed(planes, "some", contexts, _CLASS_BITS, numbers)  # noqa: E731

    assert _round_trip(walk, values) == values.tolist()


def test_the_largest_class_has_62_bits():
    values = np.array([(1 << 62) - 1, 0, 1 << 61])
    contexts = np.zeros(3, dtype=np.int64)
    walk = lambda planes, numbers: code_unsigned(planes, "some", contexts, 6, numbers)  # noqa: E731

    assert _round_trip(walk, values) == values.tolist()


def test_equal_small_numbers_cost_almost_nothing():
    writer = PlaneWriter(ContextCounts())
    contexts = np.zeros(10_000, dtype=np.int64)
    code_signed(writer, "some", contexts, _CLASS_BITS, np.full(10_000, -5))

    assert writer.section().byte_count() < 40
