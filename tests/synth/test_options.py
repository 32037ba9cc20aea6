import numpy as np
import pytest

from quarc_ref.synth.options import SynthOptions, draw_uniform


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("width", 161),
        ("height", 8),
        ("frames", 0),
        ("frames_per_second", 0),
        ("seed", -1),
        ("cameras", 1),
        ("cameras", 100),
    ],
)
def test_an_invalid_number_is_rejected_by_name(name, value):
    with pytest.raises(ValueError, match=name):
        SynthOptions(**{name: value})


def test_the_defaults_are_twelve_cameras_and_a_held_out_one():
    options = SynthOptions()

    assert (options.width, options.height, options.frames, options.cameras) == (160, 120, 24, 12)


def test_another_number_for_a_purpose_changes_no_earlier_one():
    assert np.array_equal(draw_uniform(3, "phases", 9)[:5], draw_uniform(3, "phases", 5))


def test_purposes_and_seeds_have_their_own_numbers():
    numbers = [
        draw_uniform(0, "phases", 4),
        draw_uniform(0, "palette", 4),
        draw_uniform(1, "phases", 4),
    ]

    assert len({tuple(row) for row in numbers}) == 3
