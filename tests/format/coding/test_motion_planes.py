import numpy as np
import pytest
from hypothesis import given

from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.motion_planes import LevelContext, read_motion, write_motion
from quarc_ref.format.errors import EncodeError
from tests import strategies

_NEW = ContextCounts()


@given(strategies.motions())
def test_symbols_of_a_frame_survive_a_round_trip(frame):
    contexts, symbols = frame

    decoded, _ = read_motion(write_motion(contexts, symbols, _NEW), contexts, _NEW)

    assert [level.tolist() for level in decoded] == [level.tolist() for level in symbols]


def _one_level(symbols):
    context = LevelContext(np.zeros(symbols.shape[1], dtype=int), np.zeros_like(symbols))
    return [context], [symbols]


@pytest.mark.parametrize("symbol", [65, -65])
def test_the_largest_symbols_survive_a_round_trip(symbol):
    contexts, symbols = _one_level(np.array([[symbol], [0], [0], [0], [0], [symbol]]))

    decoded, _ = read_motion(write_motion(contexts, symbols, _NEW), contexts, _NEW)

    assert decoded[0].tolist() == symbols[0].tolist()


def test_a_larger_symbol_cannot_be_written():
    with pytest.raises(EncodeError, match="increase the step"):
        write_motion(*_one_level(np.full((6, 1), 66)), _NEW)


def test_a_static_frame_after_another_costs_nothing():
    contexts, symbols = _one_level(np.zeros((6, 1000), dtype=int))

    _, counts = read_motion(write_motion(contexts, symbols, _NEW), contexts, _NEW)
    section = write_motion(contexts, symbols, counts)

    assert section.words.size == 0
    assert not read_motion(section, contexts, counts)[0][0].any()


def test_repeated_motion_costs_less():
    rng = np.random.default_rng(0)
    moving = rng.random(3000) < 0.1
    symbols = rng.integers(1, 3, (6, 3000)) * moving
    blank, _ = _one_level(symbols)
    known = [LevelContext(blank[0].parents, symbols)]

    assert write_motion(known, [symbols], _NEW).byte_count() < 0.6 * (
        write_motion(blank, [symbols], _NEW).byte_count()
    )


def test_residuals_of_the_parent_are_not_expected_again():
    """Half of the motion of the last frame: if the parent moves like this, its children do not."""
    last = np.zeros((6, 3000), dtype=int)
    last[:, ::20] = 2
    parents = np.arange(3000)
    levels = [LevelContext(parents, last), LevelContext(np.zeros(3000, dtype=int), last)]
    children = last - last

    by_parent = write_motion(levels, [children, last], _NEW).byte_count()
    by_children = write_motion(levels, [last, last], _NEW).byte_count()

    assert by_parent < 0.7 * by_children


def test_similar_frames_cost_less_over_time():
    rng = np.random.default_rng(0)
    symbols = rng.integers(1, 4, (6, 400)) * (rng.random(400) < 0.1)
    contexts, _ = _one_level(symbols)
    first = write_motion(contexts, [symbols], _NEW)
    _, counts = read_motion(first, contexts, _NEW)

    assert write_motion(contexts, [symbols], counts).byte_count() < first.byte_count()
