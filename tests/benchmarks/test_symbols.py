import numpy as np
import pytest

import symbols
from quarc_ref.decoder.reconstruct import begin_frame


@pytest.fixture(scope="module")
def start_time():
    return begin_frame(symbols.make_canonical(4000, np.random.default_rng(0)), 0)


@pytest.mark.parametrize("share", [0.01, 0.07])
def test_symbols_are_as_sparse_as_requested(start_time, share):
    scenery = symbols.make_scene_motion(start_time, np.random.default_rng(1))

    assert symbols.compute_nonzero_share(
        symbols.make_symbols(start_time, scenery, share)
    ) == pytest.approx(share, rel=0.25)


def test_an_anchor_moves_more_often_if_its_parent_moves(start_time):
    scenery = symbols.make_scene_motion(start_time, np.random.default_rng(1))
    fine, coarse, _ = symbols.make_symbols(start_time, scenery, 0.07)
    parents = start_time.known_anchors.levels[0].parents
    moves = np.any(fine, axis=0)
    parent_moves = np.any(coarse, axis=0)[parents]

    assert moves[parent_moves].mean() > 3 * moves[~parent_moves].mean()


def test_all_readers_are_timed_on_the_same_symbols():
    state = symbols.make_canonical(1000, np.random.default_rng(0))
    rows = symbols.time_regime(state, 0.07, births=10, repeats=1)

    assert [row["reader"] for row in rows] == list(symbols.choose_readers())
    assert rows[-1]["reader"] == "python"
    assert len({(row["bytes"], row["nonzero"], row["anchors"]) for row in rows}) == 1
    assert all(row["ms"] > 0 for row in rows)
