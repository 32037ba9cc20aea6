"""Tests the closed loop in floats against the decoder."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.spatial import cKDTree

from paper.float_bytes import estimate_float_bytes, summarize_floats
from paper.trials import Trial
from paper.unquantized import (
    encode_unquantized,
    move_without_rounding,
    refine_header,
)
from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.reconstruct import begin_frame, move
from quarc_ref.encoder.training.context import make_context
from quarc_ref.encoder.training.quantize import quantize_gaussians
from quarc_ref.encoder.training.straight_through import translation_step
from quarc_ref.encoder.training.trainable import from_splats
from quarc_ref.evaluation.metrics import measure_psnr
from quarc_ref.format.records import OPACITY, StreamHeader
from quarc_ref.rendering.pictures import render_picture
from tests.encoder.toys import SMALL, make_capture, make_splats

SLOW_CONFIG = replace(SMALL, stream=replace(SMALL.stream, resample_interval=4))
_REFINEMENT = 16


def _encode_floats(config, floats, frames=3, **trial_options):
    trial, capture = Trial("toy", "toy", config, floats, **trial_options), make_capture()
    context = make_context(capture, "cpu", config.seed)
    return list(encode_unquantized(capture, trial, frames, context))


@pytest.fixture(scope="module")
def frames():
    return _encode_floats(SLOW_CONFIG, "all")


def _begin_frame(components=3):
    header = StreamHeader(rotation_components=components)
    gaussians = quantize_gaussians(from_splats(make_splats(0), torch.device("cpu")), header)
    return begin_frame(begin_canonical(header, 0, gaussians), 0)


@pytest.mark.parametrize("components", [3, 4])
def test_whole_residuals_move_a_scene_as_the_decoder_does(components):
    start_state = _begin_frame(components)
    rng = np.random.default_rng(1)
    anchor_counts = [level.owners.size for level in start_state.required_anchors.levels]
    symbols = [rng.integers(-6, 7, (3 + components, size)) for size in anchor_counts]

    decoded_state = move(start_state, symbols)
    float_state = move_without_rounding(
        start_state, torch.from_numpy(np.concatenate(symbols, axis=1).T)
    )

    assert np.array_equal(float_state.scene.positions, decoded_state.scene.positions)
    assert np.abs(float_state.scene.rotations - decoded_state.scene.rotations).max() <= 3
    assert np.array_equal(float_state.motion, decoded_state.motion)


def test_a_residual_of_a_third_of_a_step_is_not_lost():
    header = refine_header(StreamHeader(), 3.0)
    splats = from_splats(make_splats(0), torch.device("cpu"))
    start_state = begin_frame(begin_canonical(header, 0, quantize_gaussians(splats, header)), 0)
    count = sum(level.owners.size for level in start_state.required_anchors.levels)
    residuals = torch.zeros(count, 6)
    residuals[:, 0] = 1 / 3

    moved_positions = dequantize(move_without_rounding(start_state, residuals).scene).positions
    shift = moved_positions - dequantize(start_state.scene).positions

    assert np.allclose(
        shift[:, 0], translation_step(header), rtol=1e-3
    )  # a third of a step on each of three levels
    assert not shift[:, 1:].any()


def test_refinement_makes_attribute_steps_finer_but_not_those_of_residuals():
    header = StreamHeader()
    refined_header = refine_header(header, 3.0)

    assert translation_step(refined_header) == translation_step(header)
    assert refined_header.rotation_unity == header.rotation_unity
    assert refined_header.opacity_step == header.opacity_step / _REFINEMENT
    assert refined_header.lattice_exponent == header.lattice_exponent + 6
    assert refine_header(header, 900.0).lattice_exponent == header.lattice_exponent


def test_scenes_in_floats_follow_the_pictures(frames):
    capture = make_capture()
    psnr = []
    for encoded_frame in frames:
        picture = render_picture(dequantize(encoded_frame.state.scene), capture.cameras[1])
        true_picture = capture.image(1, encoded_frame.state.scene.frame) / np.float32(255)
        psnr.append(measure_psnr(np.clip(picture, 0, 1), true_picture))

    assert [encoded_frame.state.scene.frame for encoded_frame in frames] == [0, 1, 2]
    assert min(psnr[1:]) > psnr[0] - 1.5


def test_with_only_motion_in_floats_the_canonical_frame_is_quantized(frames):
    def list_opacity_remainders(encoded_frame):
        return encoded_frame.state.scene.codes[OPACITY] % _REFINEMENT

    assert list_opacity_remainders(frames[0]).any()
    assert not list_opacity_remainders(_encode_floats(SLOW_CONFIG, "motion", 1)[0]).any()


def test_the_binding_is_kept_between_samplings(frames):
    start_state = begin_frame(frames[1].state, frames[2].deaths)

    assert np.array_equal(
        frames[2].state.required_anchors.binding, start_state.required_anchors.binding
    )


def test_with_rebinding_the_nearest_anchor_is_found_again_between_samplings():
    frames = _encode_floats(SLOW_CONFIG, "all", rebinds=True)
    start_state = begin_frame(frames[1].state, frames[2].deaths)
    anchors, positions = frames[2].state.required_anchors, start_state.scene.positions

    assert all(
        map(np.array_equal, anchors.levels[0].owners, start_state.required_anchors.levels[0].owners)
    )
    for level, binding in zip(anchors.levels, anchors.binding, strict=True):
        nearest_distances, _ = cKDTree(level.positions.T).query(positions.T)
        bound_distances = np.linalg.norm(positions - level.positions[:, binding], axis=0)
        assert np.allclose(bound_distances, nearest_distances)


def test_floats_take_four_bytes_each(frames):
    trial = Trial("toy", "toy", SLOW_CONFIG, "all")
    canonical_summary, frame_summary = (
        summarize_floats(encoded_frame, trial) for encoded_frame in frames[:2]
    )

    coded_bytes = {kind: size for kind, size in canonical_summary.coded_bytes.items() if size}
    assert coded_bytes == {"canonical": 92 * canonical_summary.gaussians}
    assert frame_summary.coded_bytes["motion"] == 24 * frame_summary.anchors
    assert frame_summary.coded_bytes["births"] == 92 * frame_summary.births
    assert frame_summary.births > 0


def test_the_estimate_for_floats_is_the_entropy_of_their_values():
    equal_values = np.zeros((6, 8))
    different_values = np.arange(48.0).reshape(6, 8) / 7

    assert estimate_float_bytes((equal_values,)) == 0
    assert estimate_float_bytes((different_values,)) == 6 * 8 * 3 / 8
