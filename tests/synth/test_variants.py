import numpy as np
import pytest

from quarc_ref.synth.options import SynthOptions
from quarc_ref.synth.rig import place_cameras
from quarc_ref.synth.scene import make_scene
from quarc_ref.synth.tracer import trace_view
from quarc_ref.synth.variants import VARIANTS


def _trace(variant, time=0.3, camera=0, width=96):
    """Return the picture of a variant as floats from 0 to 255."""
    options = SynthOptions(width=width, height=3 * width // 4, variant=variant)
    scene = make_scene(options.seed, options.variant_properties)
    return trace_view(
        scene.at_time(time), place_cameras(options)[camera].at_time(time)
    ).picture.astype(float)


def _find_subject(time):
    """Return a mask of the robot: the pixels that differ much between two times."""
    change = np.abs(_trace("dark-stage", time) - _trace("dark-stage", time + 0.25))
    return change.max(axis=2) > 40


@pytest.mark.parametrize("variant", VARIANTS)
def test_every_variant_differs_from_the_playroom(variant):
    picture = _trace(variant)

    assert picture.std() > 15
    assert (variant == "playroom") == np.array_equal(picture, _trace("playroom"))


def test_an_unknown_variant_is_rejected_with_the_known_ones():
    with pytest.raises(ValueError, match="'night', not one of playroom, bright-stage"):
        SynthOptions(variant="night")


def test_the_subject_of_the_stages_is_small():
    assert 0.005 < _find_subject(0.3).mean() < 0.06


def test_the_subject_has_the_same_light_on_both_stages():
    dark, bright = (_trace(f"{light}-stage", width=288) for light in ("dark", "bright"))
    is_lit = dark.max(axis=2) > 60
    shifts = [(x, y) for x in (-3, 0, 3) for y in (-3, 0, 3)]
    is_inside = np.all([np.roll(is_lit, shift, axis=(0, 1)) for shift in shifts], axis=0)

    assert is_inside.sum() > 200
    is_equal = (dark == bright).all(axis=2)[is_inside]
    assert (
        is_equal.mean() > 0.95
    )  # all except some slits between limbs, through which the hall is visible


def test_the_dark_stage_is_black_except_for_the_subject_and_the_lamps():
    dark, bright = _trace("dark-stage"), _trace("bright-stage")

    assert np.median(dark) < 25 < 80 < np.median(bright)
    assert (dark.min(axis=2) > 200).any()


def test_only_one_variant_has_cameras_of_different_gain_and_color():
    color_matrices = np.stack(
        [camera.color_matrix for camera in place_cameras(SynthOptions(variant="mixed-cameras"))]
    )
    gains = np.diagonal(color_matrices, axis1=1, axis2=2)

    assert 0.15 < np.log(gains).std(axis=0).mean() < 0.4
    assert 0.02 < np.log(gains).std(axis=1).mean() < 0.15
    assert all(
        np.array_equal(camera.color_matrix, np.eye(3)) for camera in place_cameras(SynthOptions())
    )


def test_only_one_variant_has_exposures_that_change_over_time():
    for variant in VARIANTS:
        cameras = place_cameras(SynthOptions(variant=variant))
        gains = np.array(
            [
                [np.trace(camera.at_time(time).color_matrix) for time in np.arange(30) / 30]
                for camera in cameras
            ]
        )

        logarithms = np.log(gains / gains.mean(axis=1, keepdims=True))
        if variant == "auto-exposure":
            assert 0.18 < np.abs(logarithms).max(axis=1).min() < 0.25
            assert np.abs(logarithms.mean(axis=0)).max() < 0.1  # different phases
        else:
            assert np.abs(logarithms).max() < 1e-9


def test_the_fast_variant_is_the_playroom_at_triple_speed():
    np.testing.assert_array_equal(_trace("fast", 0.2), _trace("playroom", 0.6))


def test_the_visitor_appears_and_leaves():
    changes = [
        np.abs(_trace("visitor", time) - _trace("playroom", time)).max(axis=2) > 30
        for time in (0.0, 0.35, 0.5, 0.79)
    ]

    assert [change.mean() > 0.01 for change in changes] == [False, True, True, False]
    assert not (changes[1] & changes[2]).any()
