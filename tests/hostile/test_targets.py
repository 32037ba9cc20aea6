"""Tests that all readers of bytes return or raise a documented error for any input."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fuzz.targets import TARGETS, list_seeds
from hostile.mutations import damage_bytes

_SEEDS = {name: list_seeds(name) for name in TARGETS}
_NUMBERS = st.integers(0, (1 << 32) - 1)


@pytest.mark.parametrize("name", TARGETS)
def test_seeds_do_not_fail(name):
    assert len(_SEEDS[name]) > 0
    for seed in _SEEDS[name]:
        TARGETS[name](seed)


@settings(deadline=None)
@pytest.mark.parametrize("name", TARGETS)
@given(number=_NUMBERS)
def test_damaged_seeds_raise_only_expected_errors(name, number):
    rng = random.Random(number)
    data, _ = damage_bytes(rng, rng.choice(_SEEDS[name]), rng.choice(_SEEDS[name]))
    TARGETS[name](data)


@settings(deadline=None)
@pytest.mark.parametrize("name", TARGETS)
@given(data=st.binary(max_size=200))
def test_random_bytes_raise_only_expected_errors(name, data):
    TARGETS[name](data)
