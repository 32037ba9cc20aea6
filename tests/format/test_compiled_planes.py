"""The compiled reader against the one that asks `ans` and constriction, on the same sections."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.format.acceleration import COMPILED, PLAIN, computing_with
from quarc_ref.format.contexts import ContextCounts
from quarc_ref.format.entropy import decoding_with, open_fastest
from quarc_ref.format.errors import BitstreamError
from quarc_ref.format.gaussian_planes import read_births, write_births
from quarc_ref.format.motion_planes import read_motion, write_motion
from quarc_ref.format.planes import PlaneReader, PlaneWriter, open_planes
from quarc_ref.format.records import Section, StreamHeader
from quarc_ref.format.values import code_fixed, code_signed, code_unsigned
from tests import strategies

pytest.importorskip("numba")

_PLANES = st.lists(
    st.lists(st.tuples(st.integers(0, 7), st.booleans()), min_size=1, max_size=120).map(np.array),
    min_size=1,
    max_size=4,
)


@pytest.fixture(autouse=True)
def no_chosen_decoder():
    """Lift what makes every other test ask both decoders: the compiled one is a third."""
    with decoding_with(None):
        yield


def _write(planes, counts):
    writer = PlaneWriter(counts)
    for plane in planes:
        writer.code("some", plane[:, 0], plane[:, 1].astype(bool))
        writer.code_raw(plane[:3, 1].astype(bool))
    return writer.section()


def _read(section, planes, counts, kernels):
    """What a reader gives of a section and how it goes on counting; or its refusal."""
    try:
        with computing_with(kernels):
            reader = open_planes(section, counts, 1)
        answers = []
        for plane in planes:
            blank = np.zeros(plane.shape[0], dtype=bool)
            answers.append(reader.code("some", plane[:, 0], blank).tolist())
            answers.append(reader.code_raw(blank[:3]).tolist())
        seen = reader.finish()
    except BitstreamError as error:
        return error.reject_id, None
    return answers, seen


def _shown(counts):
    return None if counts is None else counts.of("some", np.arange(8)).tolist()


@given(_PLANES, _PLANES)
def test_both_readers_give_the_same_and_count_the_same(first, second):
    plain = compiled = ContextCounts()
    for planes in (first, second):
        section = _write(planes, plain)
        expected, plain = _read(section, planes, plain, PLAIN)
        answers, compiled = _read(section, planes, compiled, COMPILED)
        assert answers == expected
        assert _shown(compiled) == _shown(plain)


@given(_PLANES, st.lists(st.integers(0, (1 << 32) - 1), max_size=12))
def test_of_any_words_both_readers_give_the_same_or_refuse_for_the_same_reason(planes, words):
    section = replace(_write(planes, ContextCounts()), words=np.array(words, dtype=np.uint32))

    expected, plain = _read(section, planes, ContextCounts(), PLAIN)
    answers, compiled = _read(section, planes, ContextCounts(), COMPILED)

    assert answers == expected
    assert _shown(compiled) == _shown(plain)


def test_counts_are_halved_alike():
    rng = np.random.default_rng(0)
    planes = [np.stack([rng.integers(0, 2, 9000), rng.random(9000) < 0.03], axis=1).astype(int)]
    section = _write(planes, ContextCounts())

    readers = [_read(section, planes, ContextCounts(), kernels) for kernels in (PLAIN, COMPILED)]

    assert readers[0][0] == readers[1][0]
    assert _shown(readers[0][1]) == _shown(readers[1][1])


_NUMBERS = st.lists(
    st.tuples(st.integers(0, 2), st.integers(-((1 << 15) - 1), (1 << 15) - 1)), max_size=40
)


def _walk(planes, numbers):
    contexts, values = np.array(numbers, dtype=np.int64).reshape(-1, 2).T.copy()
    return [
        code_fixed(planes, "f", contexts, 3, values & 7).tolist(),
        code_unsigned(planes, "u", contexts, 6, np.abs(values) << 30).tolist(),
        code_signed(planes, "s", contexts, 4, values).tolist(),
    ]


def _read_numbers(section, numbers, counts, kernels):
    try:
        with computing_with(kernels):
            reader = open_planes(section, counts, 1)
        read = _walk(reader, [(context, 0) for context, _ in numbers])
        seen = reader.finish()
    except BitstreamError as error:
        return error.reject_id, None
    models = [f"{name}, {part}" for name in "fus" for part in ("class", "sign", "mantissa")]
    return read, [seen.of(model, np.arange(1 << 10)).tolist() for model in models]


@given(_NUMBERS, _NUMBERS)
def test_numbers_are_read_as_a_whole_as_they_are_plane_by_plane(first, second):
    counts = ContextCounts()
    for numbers in (first, second):
        writer = PlaneWriter(counts)
        written = _walk(writer, numbers)
        section = writer.section()
        plain = _read_numbers(section, numbers, counts, PLAIN)

        assert plain[0] == written
        assert _read_numbers(section, numbers, counts, COMPILED) == plain
        with computing_with(PLAIN):
            reader = open_planes(section, counts, 1)
        _walk(reader, numbers)
        counts = reader.finish()


@given(_NUMBERS, st.lists(st.integers(0, (1 << 32) - 1), max_size=12))
def test_of_any_words_numbers_are_read_alike_or_refused_alike(numbers, words):
    section = Section(np.array(words, dtype=np.uint32))

    expected = _read_numbers(section, numbers, ContextCounts(), PLAIN)

    assert _read_numbers(section, numbers, ContextCounts(), COMPILED) == expected


def _read_motion(section, contexts, counts, kernels):
    try:
        with computing_with(kernels):
            symbols, seen = read_motion(section, contexts, counts)
    except BitstreamError as error:
        return error.reject_id, None
    questions = ("moves", "translation not 0", "w not 0", "rotation not 0", "sign", "magnitude")
    models = [f"motion {level + 1}, {question}" for level in range(3) for question in questions]
    return [level.tolist() for level in symbols], [
        seen.of(model, np.arange(33)).tolist() for model in models
    ]


@given(strategies.motions(), st.data())
def test_levels_are_read_as_a_whole_as_they_are_plane_by_plane(motion, data):
    contexts, symbols = motion
    far = data.draw(st.sampled_from([1, 5, 13]))
    section = write_motion(contexts, [level * far for level in symbols], ContextCounts())

    read, seen = _read_motion(section, contexts, ContextCounts(), PLAIN)

    assert read == [(level * far).tolist() for level in symbols]
    assert _read_motion(section, contexts, ContextCounts(), COMPILED) == (read, seen)


@given(strategies.motions(), st.lists(st.integers(0, (1 << 32) - 1), max_size=12))
def test_of_any_words_levels_are_read_alike_or_refused_alike(motion, words):
    section = Section(np.array(words, dtype=np.uint32))

    expected = _read_motion(section, motion[0], ContextCounts(), PLAIN)

    assert _read_motion(section, motion[0], ContextCounts(), COMPILED) == expected


@given(strategies.births(StreamHeader(), 6, 20))
def test_newborn_come_back_through_the_compiled_reader(births):
    section = write_births(births, ContextCounts())

    with computing_with(COMPILED):
        read, _ = read_births(section, 16, 6, ContextCounts())

    assert np.array_equal(read.parents, births.parents)
    assert np.array_equal(read.newborn.codes, births.newborn.codes)
    assert np.array_equal(read.newborn.rotations, births.newborn.rotations)


def test_a_decoder_that_was_chosen_is_the_one_that_reads():
    section = _write([np.array([[0, 1], [0, 0]])], ContextCounts())

    with computing_with(COMPILED), decoding_with(open_fastest):
        assert isinstance(open_planes(section, ContextCounts(), 1 << 20), PlaneReader)
