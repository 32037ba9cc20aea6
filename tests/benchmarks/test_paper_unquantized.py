"""Compares the loop in floats with the decoder."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.spatial import cKDTree

from paper.float_bytes import estimate_floats, summarize_floats
from paper.trials import Trial
from paper.unquantized import encode_unquantized, move_freely, open_training_context, refine_header
from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.reconstruct import begin_frame, move
from quarc_ref.encoder.progress import NullProgress
from quarc_ref.encoder.training.quantize import quantize_gaussians
from quarc_ref.encoder.training.straight_through import translation_step
from quarc_ref.encoder.training.trainable import from_splats
from quarc_ref.evaluation.metrics import measure_psnr
from quarc_ref.format.records import OPACITY, StreamHeader
from quarc_ref.rendering.pictures import render_picture
from tests.encoder.toys import SMALL, make_capture, make_splats

SLOW = replace(SMALL, stream=replace(SMALL.stream, resample_interval=4))
_FINER = 16


def _walk(config, floats, frames=3, **rules):
    trial, capture = Trial("toy", "toy", config, floats, **rules), make_capture()
    context = open_training_context(capture, "cpu", config.seed, NullProgress())
    return list(encode_unquantized(capture, trial, frames, context))


@pytest.fixture(scope="module")
def frames():
    return _walk(SLOW, "all")


def _begun(components=3):
    header = StreamHeader(rotation_components=components)
    gaussians = quantize_gaussians(from_splats(make_splats(0), torch.device("cpu")), header)
    return begin_frame(begin_canonical(header, 0, gaussians), 0)


@pytest.mark.parametrize("components", [3, 4])
def test_whole_residuals_move_a_scene_as_the_decoder_does(components):
    started = _begun(components)
    rng = np.random.default_rng(1)
    sizes = [level.owners.size for level in started.known_anchors.levels]
    symbols = [rng.integers(-6, 7, (3 + components, size)) for size in sizes]

    decoded = move(started, symbols)
    free = move_freely(started, torch.from_numpy(np.concatenate(symbols, axis=1).T))

    assert np.array_equal(free.scene.positions, decoded.scene.positions)
    assert np.abs(free.scene.rotations - decoded.scene.rotations).max() <= 3
    assert np.array_equal(free.motion, decoded.motion)


def test_a_residual_of_a_third_of_a_step_is_not_lost():
    header = refine_header(StreamHeader(), 3.0)
    splats = from_splats(make_splats(0), torch.device("cpu"))
    started = begin_frame(begin_canonical(header, 0, quantize_gaussians(splats, header)), 0)
    count = sum(level.owners.size for level in started.known_anchors.levels)
    residuals = torch.zeros(count, 6)
    residuals[:, 0] = 1 / 3

    moved = dequantize(move_freely(started, residuals).scene).positions
    shift = moved - dequantize(started.scene).positions

    assert np.allclose(shift[:, 0], translation_step(header), rtol=1e-3)  # three levels of a third
    assert not shift[:, 1:].any()


def test_refinement_makes_attribute_steps_finer_but_not_those_of_residuals():
    header = StreamHeader()
    fine = refine_header(header, 3.0)

    assert translation_step(fine) == translation_step(header)
    assert fine.rotation_unity == header.rotation_unity
    assert fine.opacity_step == header.opacity_step / _FINER
    assert fine.lattice_exponent == header.lattice_exponent + 6
    assert refine_header(header, 900.0).lattice_exponent == header.lattice_exponent


def test_scenes_in_floats_follow_the_pictures(frames):
    capture = make_capture()
    psnr = []
    for made in frames:
        picture = render_picture(dequantize(made.state.scene), capture.cameras[1])
        truth = capture.image(1, made.state.scene.frame) / np.float32(255)
        psnr.append(measure_psnr(np.clip(picture, 0, 1), truth))

    assert [made.state.scene.frame for made in frames] == [0, 1, 2]
    assert min(psnr[1:]) > psnr[0] - 1.5


def test_with_only_motion_in_floats_the_canonical_frame_is_quantized(frames):
    def opacities(made):
        return made.state.scene.codes[OPACITY] % _FINER

    assert opacities(frames[0]).any()
    assert not opacities(_walk(SLOW, "motion", 1)[0]).any()


def test_the_binding_is_kept_between_samplings(frames):
    started = begin_frame(frames[1].state, frames[2].deaths)

    assert np.array_equal(frames[2].state.known_anchors.binding, started.known_anchors.binding)


def test_with_rebinding_the_nearest_anchor_is_found_again_between_samplings():
    frames = _walk(SLOW, "all", rebinds=True)
    started = begin_frame(frames[1].state, frames[2].deaths)
    anchors, positions = frames[2].state.known_anchors, started.scene.positions

    assert all(
        map(np.array_equal, anchors.levels[0].owners, started.known_anchors.levels[0].owners)
    )
    for level, binding in zip(anchors.levels, anchors.binding, strict=True):
        least, _ = cKDTree(level.positions.T).query(positions.T)
        found = np.linalg.norm(positions - level.positions[:, binding], axis=0)
        assert np.allclose(found, least)


def test_floats_take_four_bytes_each(frames):
    trial = Trial("toy", "toy", SLOW, "all")
    first, second = (summarize_floats(made, trial) for made in frames[:2])

    coded = {kind: size for kind, size in first.coded_bytes.items() if size}
    assert coded == {"canonical": 92 * first.gaussians}
    assert second.coded_bytes["motion"] == 24 * second.anchors
    assert second.coded_bytes["births"] == 92 * second.births
    assert second.births > 0


def test_the_estimate_for_floats_is_the_entropy_of_their_values():
    same = np.zeros((6, 8))
    different = np.arange(48.0).reshape(6, 8) / 7

    assert estimate_floats((same,)) == 0
    assert estimate_floats((different,)) == 6 * 8 * 3 / 8
