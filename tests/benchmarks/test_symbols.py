import numpy as np
import pytest

import symbols
from quarc_ref.decoder.reconstruct import begin_frame


@pytest.fixture(scope="module")
def frame_start():
    return begin_frame(symbols.make_canonical(4000, np.random.default_rng(0)), 0)


@pytest.mark.parametrize("share", [0.01, 0.07])
def test_symbols_are_as_sparse_as_requested(frame_start, share):
    scene_motion = symbols.make_scene_motion(frame_start, np.random.default_rng(1))

    assert symbols.compute_nonzero_share(
        symbols.make_symbols(frame_start, scene_motion, share)
    ) == pytest.approx(share, rel=0.25)


def test_an_anchor_moves_more_often_if_its_parent_moves(frame_start):
    scene_motion = symbols.make_scene_motion(frame_start, np.random.default_rng(1))
    fine_symbols, coarse_symbols, _ = symbols.make_symbols(frame_start, scene_motion, 0.07)
    parents = frame_start.required_anchors.levels[0].parents
    is_moving = np.any(fine_symbols, axis=0)
    is_parent_moving = np.any(coarse_symbols, axis=0)[parents]

    assert is_moving[is_parent_moving].mean() > 3 * is_moving[~is_parent_moving].mean()


def test_all_readers_are_timed_on_the_same_symbols():
    state = symbols.make_canonical(1000, np.random.default_rng(0))
    rows = symbols.time_regime(state, 0.07, births=10, repeats=1)

    assert [row["reader"] for row in rows] == list(symbols.make_decoder_contexts())
    assert rows[-1]["reader"] == "python"
    assert len({(row["bytes"], row["nonzero"], row["anchors"]) for row in rows}) == 1
    assert all(row["ms"] > 0 for row in rows)
