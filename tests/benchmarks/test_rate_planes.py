import lzma
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rate.planes import (
    compress_lzma,
    compress_zstd,
    pack_frame,
    pack_planes,
    read_symbols,
    sum_compressed,
    sum_floats,
)
from tests.small_streams import make_stream

ROWS = st.lists(st.lists(st.integers(-(1 << 62), 1 << 62), max_size=6), max_size=5)


def _as_rows(lists):
    return [np.array(each, dtype=np.int64) for each in lists]


def _unpack(data, lists):
    """Parse rows by the simplest rule: the narrowest type whose range includes the row."""
    rows = []
    for numbers in lists:
        width = next(
            size
            for size in (1, 2, 4, 8)
            if all(-(1 << 8 * size - 1) <= number < 1 << 8 * size - 1 for number in numbers)
        )
        taken, data = data[: width * len(numbers)], data[width * len(numbers) :]
        rows.append(
            [
                int.from_bytes(taken[start : start + width], "little", signed=True)
                for start in range(0, len(taken), width)
            ]
        )
    assert not data
    return rows


@given(ROWS)
def test_planes_are_packed_as_narrowly_as_each_row_allows(lists):
    assert _unpack(pack_planes(_as_rows(lists)), lists) == lists


@pytest.fixture(scope="module")
def made():
    data, states = make_stream(canonical_every=3, frame_count=5)
    return states, list(read_symbols(data))


def test_the_symbols_of_every_frame_are_those_of_the_stream(made):
    states, frames = made

    assert [frame.canonical is not None for frame in frames] == [True, False, False, True, False]
    for (before, state), frame in zip(pairwise(states), frames[1:], strict=True):
        if frame.canonical is not None:
            assert frame.canonical.count == state.scene.count
            continue
        assert all(map(np.array_equal, frame.motion, state.symbols))
        newborn = 0 if frame.births is None else frame.births.newborn.count
        assert newborn == state.next_id - before.next_id


def test_a_frame_gives_a_block_for_each_kind_it_has(made):
    _, frames = made

    kinds = [set(pack_frame(frame)) for frame in frames]
    assert kinds[:3] == [{"canonical"}, {"motion", "births"}, {"motion"}]


def test_symbols_of_motion_take_one_byte_each(made):
    _, frames = made

    assert len(pack_frame(frames[1])["motion"]) == sum(level.size for level in frames[1].motion)


def test_sizes_are_summed_over_frames_by_kind(made):
    _, frames = made
    blocks = [pack_frame(frame) for frame in frames]

    sizes = sum_compressed(frames, lambda block: block[::2])
    for kind in ("canonical", "motion", "births"):
        assert sizes[kind] == sum((len(block.get(kind, b"")) + 1) // 2 for block in blocks)


def test_floats_are_92_bytes_per_gaussian_and_28_per_anchor(made):
    _, frames = made
    gaussians = sum(frame.canonical.count for frame in frames if frame.canonical)
    newborn = sum(frame.births.newborn.count for frame in frames if frame.births)
    anchors = sum(level.shape[1] for frame in frames for level in frame.motion)

    assert sum_floats(frames) == {
        "canonical": 92 * gaussians,
        "motion": 28 * anchors,
        "births": 92 * newborn,
    }


@given(st.binary(max_size=300))
def test_lzma_restores_the_block(block):
    assert lzma.decompress(compress_lzma(block)) == block


@given(st.binary(max_size=300))
def test_zstd_restores_the_block(block):
    zstandard = pytest.importorskip("zstandard")

    decompressor = zstandard.ZstdDecompressor().decompressobj()
    assert decompressor.decompress(compress_zstd(block)) == block
