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
    pack_rows,
    read_symbols,
    sum_compressed_bytes,
    sum_float_bytes,
)
from tests.small_streams import make_stream

ROW_LISTS = st.lists(st.lists(st.integers(-(1 << 62), 1 << 62), max_size=6), max_size=5)


def _make_arrays(rows):
    return [np.array(row, dtype=np.int64) for row in rows]


def _unpack_rows(data, expected_rows):
    """Parse packed rows; each row has the narrowest integer type whose range includes it."""
    rows = []
    for row in expected_rows:
        width = next(
            size
            for size in (1, 2, 4, 8)
            if all(-(1 << 8 * size - 1) <= value < 1 << 8 * size - 1 for value in row)
        )
        row_bytes, data = data[: width * len(row)], data[width * len(row) :]
        rows.append(
            [
                int.from_bytes(row_bytes[start : start + width], "little", signed=True)
                for start in range(0, len(row_bytes), width)
            ]
        )
    assert not data
    return rows


@given(ROW_LISTS)
def test_planes_are_packed_as_narrowly_as_each_row_allows(rows):
    assert _unpack_rows(pack_rows(_make_arrays(rows)), rows) == rows


@pytest.fixture(scope="module")
def states_and_symbols():
    data, states = make_stream(canonical_every=3, frame_count=5)
    return states, list(read_symbols(data))


def test_the_symbols_of_every_frame_are_those_of_the_stream(states_and_symbols):
    states, frames = states_and_symbols

    assert [frame.canonical is not None for frame in frames] == [True, False, False, True, False]
    for (previous_state, state), frame in zip(pairwise(states), frames[1:], strict=True):
        if frame.canonical is not None:
            assert frame.canonical.count == state.scene.count
            continue
        assert all(map(np.array_equal, frame.motion, state.symbols))
        birth_count = 0 if frame.births is None else frame.births.newborn.count
        assert birth_count == state.next_id - previous_state.next_id


def test_a_frame_gives_a_block_for_each_kind_it_has(states_and_symbols):
    _, frames = states_and_symbols

    kinds = [set(pack_frame(frame)) for frame in frames]
    assert kinds[:3] == [{"canonical"}, {"motion", "births"}, {"motion"}]


def test_symbols_of_motion_take_one_byte_each(states_and_symbols):
    _, frames = states_and_symbols

    assert len(pack_frame(frames[1])["motion"]) == sum(level.size for level in frames[1].motion)


def test_sizes_are_summed_over_frames_by_kind(states_and_symbols):
    _, frames = states_and_symbols
    blocks = [pack_frame(frame) for frame in frames]

    sizes = sum_compressed_bytes(frames, lambda block: block[::2])
    for kind in ("canonical", "motion", "births"):
        assert sizes[kind] == sum((len(block.get(kind, b"")) + 1) // 2 for block in blocks)


def test_floats_are_92_bytes_per_gaussian_and_28_per_anchor(states_and_symbols):
    _, frames = states_and_symbols
    gaussians = sum(frame.canonical.count for frame in frames if frame.canonical)
    newborn = sum(frame.births.newborn.count for frame in frames if frame.births)
    anchors = sum(level.shape[1] for frame in frames for level in frame.motion)

    assert sum_float_bytes(frames) == {
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
