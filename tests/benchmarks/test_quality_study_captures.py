import pytest
from hypothesis import given
from hypothesis import strategies as st

from quality.study_captures import DEFAULT_TRACED_NAMES, choose_held_out_sets, parse_traced_name
from quarc_ref.synth import SynthOptions
from quarc_ref.synth.variants import VARIANTS


def test_the_held_out_sets_rotate_through_the_rig():
    names = [f"cam{index:02}" for index in range(30)]
    held_out_sets = [
        tuple(int(name[3:]) for name in held_out) for held_out in choose_held_out_sets(names)
    ]

    assert held_out_sets == [(1, 11, 21), (3, 13, 23), (5, 15, 25), (7, 17, 27)]


@given(count=st.integers(4, 60))
def test_each_set_has_three_different_cameras(count):
    names = [f"cam{index:02}" for index in range(count)]

    for held_out in choose_held_out_sets(names):
        assert len(set(held_out)) == 3
        assert set(held_out) < set(names)


@pytest.mark.parametrize(("count", "set_count"), [(4, 4), (6, 2), (9, 3), (12, 4), (18, 4)])
def test_no_set_is_held_out_twice(count, set_count):
    names = [f"cam{index:02}" for index in range(count)]

    held_out_sets = choose_held_out_sets(names)

    assert len({frozenset(held_out) for held_out in held_out_sets}) == set_count
    assert len(held_out_sets) == set_count


def test_too_few_cameras_are_rejected():
    with pytest.raises(ValueError, match="3 cameras are too few"):
        choose_held_out_sets(["a", "b", "c"])


def test_all_variants_are_traced_and_the_playroom_with_more_cameras_and_pixels():
    options = [parse_traced_name(name) for name in DEFAULT_TRACED_NAMES]

    assert {option.variant for option in options} == set(VARIANTS)
    playrooms = [option for option in options if option.variant == "playroom"]
    assert {option.cameras + 1 for option in playrooms} == {4, 8, 13, 30}
    assert {(option.width, option.height) for option in playrooms} == {(160, 120), (640, 480)}
    assert len(set(DEFAULT_TRACED_NAMES)) == len(DEFAULT_TRACED_NAMES)


def test_a_name_states_variant_cameras_and_size():
    assert parse_traced_name("dark-stage-5-32x24") == SynthOptions(
        32, 24, frames=40, cameras=4, variant="dark-stage"
    )


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("night", "'night' is not a traced capture: .* one of playroom, bright-stage"),
        ("playroom-x", "not a traced capture"),
        ("playroom-2", "cameras is 1"),
        ("playroom-33x24", "width is 33"),
    ],
)
def test_a_name_that_cannot_be_traced_is_rejected(name, message):
    with pytest.raises(ValueError, match=message):
        parse_traced_name(name)
