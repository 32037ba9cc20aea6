import lzma
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quarc_ref.format.records import StreamHeader
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


@pytest.fixture(scope="module")
def updated_states_and_symbols():
    header = StreamHeader(seed=7, gaussians_per_anchor=4, updates=True, snapshots=True)
    data, states = make_stream(header, frame_count=5, snapshot_every=3)
    return states, list(read_symbols(data))


def test_updates_are_index_steps_deletions_and_residuals(updated_states_and_symbols):
    states, frames = updated_states_and_symbols

    frame = next(f for f in range(1, 5) if states[f].updates and states[f].updates.dies.any())
    updates = states[frame].updates
    assert updates.dies.sum() < updates.count
    rows = [np.diff(updates.gaussians, prepend=0), updates.dies.astype(np.int64)]
    rows += list(updates.residuals[:, ~updates.dies])
    block = pack_frame(frames[frame])["updates"]
    assert _unpack_rows(block, [row.tolist() for row in rows]) == [row.tolist() for row in rows]
    assert "updates" not in pack_frame(frames[0])


def test_a_snapshot_is_one_block(updated_states_and_symbols):
    states, frames = updated_states_and_symbols

    assert [set(pack_frame(frame)) >= {"snapshots"} for frame in frames] == [
        *(False, False, False, True, False)
    ]
    assert set(pack_frame(frames[3])) == {"snapshots"}
    snapshot, canonical = frames[3].snapshot
    assert snapshot.gaussians.count == states[3].scene.count
    survivor_count = np.count_nonzero(snapshot.canonical_indices >= 0)
    lives = np.frombuffer(pack_frame(frames[3])["snapshots"][: canonical.count], np.int8)
    assert lives.sum() == survivor_count < snapshot.gaussians.count


def test_floats_are_52_bytes_per_update_and_92_per_gaussian_of_a_snapshot(
    updated_states_and_symbols,
):
    states, frames = updated_states_and_symbols
    changed = sum(np.count_nonzero(~frame.updates.dies) for frame in frames if frame.updates)

    sizes = sum_float_bytes(frames)
    assert sizes["updates"] == 52 * changed > 0
    assert sizes["snapshots"] == 92 * states[3].scene.count


@given(st.binary(max_size=300))
@settings(max_examples=10)  # the compressor fills megabytes of tables for each block
def test_lzma_restores_the_block(block):
    assert lzma.decompress(compress_lzma(block)) == block


@given(st.binary(max_size=300))
def test_zstd_restores_the_block(block):
    zstandard = pytest.importorskip("zstandard")

    decompressor = zstandard.ZstdDecompressor().decompressobj()
    assert decompressor.decompress(compress_zstd(block)) == block
