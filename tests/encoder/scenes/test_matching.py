"""Gaussians of consecutive frames are matched by ids or by order."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.decoder import Splats
from quarc_ref.encoder.scenes.matching import (
    _longest_increasing_subsequence,
    match_ids,
    match_order,
)
from tests.encoder.scenes.given import concatenate, make_splats, select_rows

_COUNT = 20
_ROWS = st.sets(st.integers(0, _COUNT - 1), min_size=1)


def _list_pairs(match):
    return list(zip(match.first_rows.tolist(), match.second_rows.tolist(), strict=True))


@given(st.permutations(range(8)), st.sets(st.integers(0, 7)))
def test_ids_are_matched_in_any_order(order, deleted):
    ids = np.array([number for number in order if number not in deleted], np.int64)

    pairs = _list_pairs(match_ids(np.arange(8), ids))

    assert pairs == sorted((number, row) for row, number in enumerate(ids.tolist()))


@given(st.lists(st.integers(0, 99), max_size=9, unique=True))
def test_a_subsequence_increases_and_none_is_longer(numbers):
    indices = _longest_increasing_subsequence(np.array(numbers, np.int64)).tolist()

    assert indices == sorted(indices)
    chosen = [numbers[index] for index in indices]
    assert chosen == sorted(chosen)
    lengths = range(len(chosen) + 1, len(numbers) + 1)
    assert not any(
        list(longer) == sorted(longer)
        for length in lengths
        for longer in combinations(numbers, length)
    )


def _make_scene(count=_COUNT, seed=0):
    """Gaussians that are much smaller than the distances between them."""
    splats = make_splats(count, seed=seed)
    return replace(splats, log_scales=splats.log_scales - 4)


@given(kept=_ROWS, born=st.integers(0, 3), position=st.integers(0, _COUNT))
def test_gaussians_with_unchanged_attributes_are_matched_between_deaths_and_births(
    kept, born, position
):
    first, rows = _make_scene(), np.array(sorted(kept))
    before, after = rows[:position], rows[position:]
    second = concatenate(
        select_rows(first, before), _make_scene(born, seed=1), select_rows(first, after)
    )
    second.positions[:] += 0.001

    pairs = _list_pairs(match_order(first, second))

    second_rows = [*range(len(before)), *range(len(before) + born, len(rows) + born)]
    expected = set(zip(rows.tolist(), second_rows, strict=True))
    assert expected <= set(pairs)
    assert pairs == sorted(pairs)
    assert len(dict(pairs)) == len({second for _, second in pairs}) == len(pairs)


def _train_all_attributes(splats, seed):
    """Return the Gaussians after small changes of all their attributes."""
    rng = np.random.default_rng(seed)
    names = ("positions", "rotations", "log_scales", "opacities", "sh")
    arrays = (getattr(splats, name) for name in names)
    return Splats(*(it + rng.normal(0, 0.0003, it.shape).astype(np.float32) for it in arrays))


@given(dead=st.sets(st.integers(0, 99), min_size=1, max_size=5), born=st.integers(0, 9))
def test_gaussians_are_matched_if_all_attributes_change_in_every_frame(dead, born):
    first, rows = _make_scene(100), np.array([row for row in range(100) if row not in dead])
    second = _train_all_attributes(select_rows(first, rows), seed=2)

    match = match_order(first, concatenate(second, _make_scene(born, seed=99)))

    own_pairs = [pair for pair in _list_pairs(match) if pair[1] < rows.size]
    assert set(own_pairs) <= set(zip(rows.tolist(), range(rows.size), strict=True))
    assert len(own_pairs) >= 90  # a Gaussian between two deaths may be lost


def test_rows_in_another_order_are_not_searched_to_the_end():
    first = _make_scene(3000)
    order = np.random.default_rng(0).permutation(2999)

    match = match_order(first, _train_all_attributes(select_rows(first, order), seed=2))

    assert match.first_rows.size < 100


def test_extreme_gaussians_are_matched():
    first = _make_scene()
    for name, number in (("log_scales", -1e30), ("positions", 3e38), ("opacities", -3e38)):
        getattr(first, name)[:15] = number
    second = select_rows(first, range(1, _COUNT))
    second.sh[:] += 0.01

    assert {(row, row - 1) for row in range(15, _COUNT)} <= set(
        _list_pairs(match_order(first, second))
    )


def test_a_gaussian_that_changes_place_is_a_death_and_a_birth():
    first = _make_scene()
    order = [*range(1, 5), 0, *range(5, _COUNT - 1)]  # the first one moves back; the last one dies

    pairs = _list_pairs(match_order(first, select_rows(first, order)))

    assert pairs == [(row, order.index(row)) for row in order if row]


@pytest.mark.parametrize(("motion", "is_matched"), [(9.9, True), (10.1, False)])
def test_between_landmarks_a_gaussian_is_matched_if_it_moves_at_most_ten_times_its_scale(
    motion, is_matched
):
    first, rows = _make_scene(), range(1, _COUNT)
    second = select_rows(first, rows)  # another number of rows, so landmarks are used
    second.opacities[6] += 1
    second.positions[6, 1] += motion * np.exp(first.log_scales[7].max())

    pairs = _list_pairs(match_order(first, second))

    assert pairs == [(row, row - 1) for row in rows if row != 7 or is_matched]


@pytest.mark.parametrize(
    ("kept", "is_matched"), [(range(20), True), ([*range(8), *range(9, 20)], False)]
)
def test_after_a_death_without_landmarks_pairs_end_at_the_first_implausible_one(kept, is_matched):
    first = concatenate(_make_scene(), _make_scene(1, seed=2))  # the last Gaussian dies
    second = select_rows(first, kept)
    second.opacities[5:8] += 1  # rows 5 to 8 of the first frame have no landmark
    if len(kept) == _COUNT:
        second.opacities[8] += 1
    second.positions[6] += 1

    pairs = _list_pairs(match_order(first, second))

    assert {row for row, _ in pairs if 5 <= row <= 8} == ({5, 7, 8} if is_matched else {5})
