import numpy as np
import pytest
from hypothesis import given

from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.motion_planes import LevelContext, read_motion, write_motion
from quarc_ref.format.errors import EncodeError
from tests import strategies

_NEW_COUNTS = ContextCounts()


@given(strategies.motions())
def test_symbols_of_a_frame_survive_a_round_trip(frame):
    contexts, symbols = frame

    decoded, _ = read_motion(write_motion(contexts, symbols, _NEW_COUNTS), contexts, _NEW_COUNTS)

    assert [level.tolist() for level in decoded] == [level.tolist() for level in symbols]


def _one_level(symbols):
    context = LevelContext(np.zeros(symbols.shape[1], dtype=int), np.zeros_like(symbols))
    return [context], [symbols]


@pytest.mark.parametrize("symbol", [65, -65])
def test_the_largest_symbols_survive_a_round_trip(symbol):
    contexts, symbols = _one_level(np.array([[symbol], [0], [0], [0], [0], [symbol]]))

    decoded, _ = read_motion(write_motion(contexts, symbols, _NEW_COUNTS), contexts, _NEW_COUNTS)

    assert decoded[0].tolist() == symbols[0].tolist()


def test_a_larger_symbol_cannot_be_written():
    with pytest.raises(EncodeError, match="increase the quantization step"):
        write_motion(*_one_level(np.full((6, 1), 66)), _NEW_COUNTS)


def test_a_static_frame_after_another_costs_nothing():
    contexts, symbols = _one_level(np.zeros((6, 1000), dtype=int))

    _, counts = read_motion(write_motion(contexts, symbols, _NEW_COUNTS), contexts, _NEW_COUNTS)
    section = write_motion(contexts, symbols, counts)

    assert section.words.size == 0
    assert not read_motion(section, contexts, counts)[0][0].any()


def test_repeated_motion_costs_less():
    rng = np.random.default_rng(0)
    moving = rng.random(3000) < 0.1
    symbols = rng.integers(1, 3, (6, 3000)) * moving
    static_context, _ = _one_level(symbols)
    same_context = [LevelContext(static_context[0].parents, symbols)]

    assert write_motion(same_context, [symbols], _NEW_COUNTS).byte_count() < 0.6 * (
        write_motion(static_context, [symbols], _NEW_COUNTS).byte_count()
    )


def test_residuals_of_the_parent_are_not_expected_again():
    """If a parent repeats the last motion, residuals of 0 are expected for its children."""
    last_motion = np.zeros((6, 3000), dtype=int)
    last_motion[:, ::20] = 2
    parents = np.arange(3000)
    levels = [
        LevelContext(parents, last_motion),
        LevelContext(np.zeros(3000, dtype=int), last_motion),
    ]
    children = last_motion - last_motion

    parent_bytes = write_motion(levels, [children, last_motion], _NEW_COUNTS).byte_count()
    both_bytes = write_motion(levels, [last_motion, last_motion], _NEW_COUNTS).byte_count()

    assert parent_bytes < 0.7 * both_bytes


def test_similar_frames_cost_less_over_time():
    rng = np.random.default_rng(0)
    symbols = rng.integers(1, 4, (6, 400)) * (rng.random(400) < 0.1)
    contexts, _ = _one_level(symbols)
    first = write_motion(contexts, [symbols], _NEW_COUNTS)
    _, counts = read_motion(first, contexts, _NEW_COUNTS)

    assert write_motion(contexts, [symbols], counts).byte_count() < first.byte_count()
