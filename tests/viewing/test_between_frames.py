"""Tests of Gaussians between two frames."""

from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.decoder import dequantize
from quarc_ref.streams import BytesSource, decode
from quarc_ref.viewing.between_frames import FramesInOrder, interpolate
from tests.small_streams import make_stream


@pytest.fixture(scope="module")
def scenes():
    """Two successive frames, the second of which has births and no deaths."""
    data, _ = make_stream()
    return list(decode(BytesSource(data), 0, 2))


def _activate(logits):
    return 1 / (1 + np.exp(-logits.astype(np.float64)))


def test_survivors_are_halfway_between_their_two_states(scenes):
    first, second = (dequantize(scene) for scene in scenes)
    kept = np.isin(scenes[0].ids, scenes[1].ids)
    still = np.isin(scenes[1].ids, scenes[0].ids)
    between = interpolate(*scenes, 0.5)

    count = int(kept.sum())
    assert between.positions[:count] == pytest.approx(
        (first.positions[kept] + second.positions[still]) / 2, abs=1e-6
    )
    assert between.sh[:count] == pytest.approx((first.sh[kept] + second.sh[still]) / 2, abs=1e-6)
    opacities = (_activate(first.opacities[kept]) + _activate(second.opacities[still])) / 2
    assert _activate(between.opacities[:count]) == pytest.approx(opacities, abs=1e-5)
    assert np.linalg.norm(between.rotations, axis=1) == pytest.approx(1, abs=1e-6)


def test_survivors_turn_the_shorter_way_and_change_their_scales(scenes):
    codes = scenes[1].codes.copy()
    codes[:3] += 9
    turned_scene = replace(
        scenes[1], rotations=np.roll(scenes[1].rotations, 1, axis=0), codes=codes
    )
    first, second = dequantize(scenes[0]), dequantize(turned_scene)
    kept = np.isin(scenes[0].ids, scenes[1].ids)
    still = np.isin(scenes[1].ids, scenes[0].ids)
    start, end = first.rotations[kept], second.rotations[still]
    is_opposite = (start * end).sum(axis=1, keepdims=True) < 0
    assert 0 < is_opposite.sum() < len(start)
    between = interpolate(scenes[0], turned_scene, 0.25)

    rotations = 0.75 * np.where(is_opposite, -start, start) + 0.25 * end
    rotations /= np.linalg.norm(rotations, axis=1, keepdims=True)
    assert between.rotations[: len(start)] == pytest.approx(rotations, abs=1e-6)
    assert between.log_scales[: len(start)] == pytest.approx(
        0.75 * first.log_scales[kept] + 0.25 * second.log_scales[still], abs=1e-5
    )


@pytest.mark.parametrize("reverse", [False, True], ids=["births", "deaths"])
def test_births_fade_in_and_deaths_fade_out(scenes, reverse):
    first, second = scenes[::-1] if reverse else scenes
    fading_scene, other_scene = (first, second) if reverse else (second, first)
    is_fading = ~np.isin(fading_scene.ids, other_scene.ids)
    assert is_fading.any()
    between = interpolate(first, second, 0.75 if reverse else 0.25)

    opacities = _activate(dequantize(fading_scene).opacities[is_fading])
    faded_opacities = _activate(between.opacities[-int(is_fading.sum()) :])
    assert faded_opacities == pytest.approx(0.25 * opacities, abs=1e-5)
    assert between.positions.shape[0] == max(first.count, second.count)


def test_frames_are_exact_and_the_next_frame_is_read_only_if_needed(scenes):
    frames = FramesInOrder(iter(scenes))
    exact, between = frames.find(0), frames.find(0, 0.5)
    last = frames.find(1)

    assert np.array_equal(exact.positions, dequantize(scenes[0]).positions)
    assert not np.array_equal(between.positions[: len(exact.positions)], exact.positions)
    assert np.array_equal(last.positions, dequantize(scenes[1]).positions)
    assert FramesInOrder(iter(scenes[:1])).find(0).positions.shape == exact.positions.shape


def test_a_frame_before_a_keyframe_stays_until_then(scenes):
    between = FramesInOrder(iter([scenes[1], scenes[0]])).find(scenes[1].frame, 0.5)

    assert np.array_equal(between.positions, dequantize(scenes[1]).positions)


def test_extreme_opacities_stay_what_they_are_without_a_warning(scenes):
    extreme_scenes = []
    for scene in scenes:
        codes = scene.codes.copy()
        codes[3] = np.where(scene.ids % 2, 32767, -32768)
        extreme_scenes.append(replace(scene, codes=codes))

    opacities = _activate(interpolate(*extreme_scenes, 0.5).opacities[: scenes[0].count])

    assert opacities == pytest.approx(scenes[0].ids % 2, abs=1e-5)
