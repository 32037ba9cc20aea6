from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.synth.options import SynthOptions
from quarc_ref.synth.rig import place_cameras
from quarc_ref.synth.scene import make_scene
from quarc_ref.synth.tracer import trace_view

_SMALL_OPTIONS = SynthOptions(width=48, height=36)


def _measure_speeds(seed):
    """Return `[T, S]` motion of the solids' centers per frame of 160x120, in pixels."""
    camera = place_cameras(SynthOptions(seed=seed))[0]
    scene = make_scene(seed)
    centers = np.stack([scene.at_time(frame / 30).solids[:, :3] for frame in range(24)])
    x, y, depth = np.moveaxis((centers - camera.center) @ camera.axes.T, 2, 0)
    pixels = camera.focal_length * np.stack((x, y), axis=2) / depth[..., None]
    return np.linalg.norm(np.diff(pixels, axis=0), axis=2)


@pytest.mark.parametrize("seed", range(5))
def test_moving_objects_move_by_a_few_pixels_and_none_by_more_than_eight(seed):
    speeds = _measure_speeds(seed)
    moving = speeds[:, speeds.max(axis=0) > 0.3]

    assert 0.3 < np.median(moving) < 3
    assert 3 < speeds.max() < 8


@pytest.mark.parametrize("seed", range(5))
def test_about_half_of_the_solids_stand_still(seed):
    share = (_measure_speeds(seed).max(axis=0) < 1e-9).mean()

    assert 0.3 < share < 0.7


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("time", [0.0, 0.45, 7.3, 1e4])
def test_solids_are_within_the_room_at_any_time(seed, time):
    solids = make_scene(seed).at_time(time).solids

    assert np.isfinite(solids).all()
    assert (np.abs(solids[:, [0, 2]]) < 3.9).all()
    assert (solids[:, 1] > 0).all()


def test_pictures_change_from_frame_to_frame_but_not_everywhere():
    scene, camera = make_scene(0), place_cameras(_SMALL_OPTIONS)[0]
    pictures = [trace_view(scene.at_time(i / 30), camera).picture.astype(float) for i in range(4)]
    changes = np.abs(np.diff(pictures, axis=0)).max(axis=3)

    assert (changes.mean(axis=(1, 2)) > 0.5).all()
    assert (changes.mean(axis=(1, 2)) < 15).all()
    assert (changes.max(axis=0) == 0).mean() > 0.1


@pytest.mark.parametrize("seed", range(5))
def test_a_picture_of_every_seed_is_neither_dark_nor_overexposed(seed):
    camera = place_cameras(replace(_SMALL_OPTIONS, seed=seed))[0]
    picture = trace_view(make_scene(seed).at_time(0.3), camera).picture

    assert 80 < picture.mean() < 180
    assert picture.std() > 25
    assert (picture.min(axis=2) > 245).mean() < 0.02
