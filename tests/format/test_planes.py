import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.format.errors import TableLengthError, UnconsumedWordsError
from quarc_ref.format.planes import PlaneReader, PlaneWriter
from quarc_ref.format.records import Section

_PLANES = st.lists(
    st.lists(st.tuples(st.integers(0, 5), st.booleans()), min_size=1, max_size=30).map(np.array),
    max_size=5,
)


def _write(planes):
    writer = PlaneWriter()
    for plane in planes:
        writer.code(plane[:, 0], plane[:, 1].astype(bool))
    return writer.section()


@given(_PLANES)
def test_a_reader_gives_the_answers_that_a_writer_was_told(planes):
    reader = PlaneReader(_write(planes))

    for plane in planes:
        contexts = plane[:, 0]
        assert reader.code(contexts, np.zeros(contexts.size, dtype=bool)).tolist() == (
            plane[:, 1].astype(bool).tolist()
        )
    reader.finish()


@given(_PLANES)
def test_the_table_has_a_byte_for_every_context_that_holds_a_bit(planes):
    used = sum(len(set(plane[:, 0].tolist())) for plane in planes)

    assert len(_write(planes).table) == used


def test_a_table_that_ends_too_early_is_refused():
    section = _write([np.array([[0, 1], [1, 0]])])
    reader = PlaneReader(Section(section.table[:1], section.words))

    with pytest.raises(TableLengthError):
        reader.code(np.array([0, 1]), np.zeros(2, dtype=bool))


def test_a_table_that_goes_on_is_refused():
    section = _write([np.array([[0, 1]])])
    reader = PlaneReader(Section(section.table + b"\0", section.words))
    reader.code(np.array([0]), np.zeros(1, dtype=bool))

    with pytest.raises(TableLengthError):
        reader.finish()


def test_planes_that_are_not_asked_for_are_refused():
    rng = np.random.default_rng(0)
    section = _write([np.stack([np.zeros(400), rng.integers(0, 2, 400)], axis=1).astype(int)])
    reader = PlaneReader(section)
    reader.code(np.zeros(10, dtype=int), np.zeros(10, dtype=bool))

    with pytest.raises(UnconsumedWordsError):
        reader.finish()


def test_raw_bits_take_no_entry_of_the_table():
    writer = PlaneWriter()
    bits = np.arange(64) % 3 == 0
    writer.code_raw(bits)
    section = writer.section()

    assert section.table == b""
    assert PlaneReader(section).code_raw(np.zeros(64, dtype=bool)).tolist() == bits.tolist()
