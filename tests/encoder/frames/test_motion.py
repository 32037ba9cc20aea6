import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from quarc_ref.datasets.capture import Capture
from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.reconstruct import begin_frame
from quarc_ref.decoder.state import State
from quarc_ref.encoder.frame_coder import FrameStart
from quarc_ref.encoder.frames.motion import fit_motion
from quarc_ref.encoder.frames.rate_control import RateDistortion
from quarc_ref.encoder.settings.frames import MotionSettings
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.quantize import quantize_gaussians
from quarc_ref.encoder.training.straight_through import position_step, without_rounding
from quarc_ref.encoder.training.trainable import from_splats
from quarc_ref.encoder.training.views import TrainingViews
from quarc_ref.format.arrays import Int64
from quarc_ref.format.records import LOG_SCALES, StreamHeader
from tests.encoder.toys import SMALL, make_capture, make_context, make_splats

_CPU = torch.device("cpu")
_DOUBLINGS = 3
_SCALE_FACTOR = 1 << _DOUBLINGS
_SCALE_FACTOR_CODES = 32
_HEADER = StreamHeader(
    gaussians_per_anchor=4,
    log_scale_step=float(np.float32(math.log(_SCALE_FACTOR) / _SCALE_FACTOR_CODES)),
)
_MOTION = replace(SMALL.motion, iterations=12, translation_lr=5.25)


def _make_state() -> State:
    splats = from_splats(make_splats(0), _CPU)
    return begin_canonical(_HEADER, 0, quantize_gaussians(splats, _HEADER))


def _coarsen_lattice(state: State) -> State:
    """Return the state on a lattice eight times as coarse, with Gaussians eight times as large."""
    scene = state.scene
    codes = scene.codes.copy()
    codes[LOG_SCALES] += _SCALE_FACTOR_CODES
    exponent = scene.header.lattice_exponent - _DOUBLINGS
    header = replace(scene.header, lattice_exponent=exponent)
    return replace(state, scene=replace(scene, header=header, codes=codes))


class _CaptureSource:
    """A picture source that returns the pictures of a capture."""

    def __init__(self, capture: Capture) -> None:
        self._capture = capture

    def read(self, camera: int, frame: int) -> np.ndarray:
        return self._capture.image(camera, frame)


def _scale_context(context: TrainingContext) -> TrainingContext:
    capture = make_capture()
    cameras = [
        replace(
            camera,
            translation=tuple(_SCALE_FACTOR * coordinate for coordinate in camera.translation),
            near=_SCALE_FACTOR * camera.near,
        )
        for camera in capture.cameras
    ]
    scaled_capture = Capture(
        "far", cameras, 4, 30.0, capture.points, _CaptureSource(capture), "0" * 64
    )
    return replace(context, views=TrainingViews(scaled_capture, _CPU))


def _fit(context: TrainingContext, state: State, settings: MotionSettings) -> Int64:
    fitted = fit_motion(context, FrameStart(state, begin_frame(state, 0), 0), settings)
    return np.concatenate(fitted.symbols, axis=1)


def test_a_capture_in_other_units_moves_by_the_same_symbols():
    context, state = make_context(), _make_state()

    symbols = _fit(context, state, _MOTION)
    scaled_symbols = _fit(_scale_context(context), _coarsen_lattice(state), _MOTION)

    assert np.count_nonzero(symbols) > 20
    assert (
        np.mean(symbols == scaled_symbols) > 0.95
    )  # a few symbols depend on the last bits of floats


def test_the_learning_rate_of_translations_is_in_world_units_or_in_position_steps():
    context, state = make_context(), _make_state()
    step = position_step(_HEADER)

    step_settings = replace(_MOTION, lr=1e-3, translation_lr=2.0)
    unit_settings = replace(_MOTION, lr=2.0 * step, translation_lr=0.0)
    rows = [_fit(context, state, settings)[:3] for settings in (step_settings, unit_settings)]

    assert np.abs(rows[0]).sum() == pytest.approx(np.abs(rows[1]).sum(), rel=0.2)


@pytest.mark.parametrize(
    ("rate_model", "weights"), [("group_log", (0.0, 2e-3, 1.0)), ("l1", (0.0, 0.1, 10.0))]
)
def test_a_higher_lambda_gives_fewer_symbols(rate_model, weights):
    context, state = make_context(), _make_state()
    settings = replace(_MOTION, rate_model=rate_model)

    counts = [
        np.count_nonzero(_fit(context, state, replace(settings, rd_lambda=weight)))
        for weight in weights
    ]
    assert counts[0] > counts[1] > counts[2]


@pytest.mark.parametrize(("rate_model", "is_relative"), [("l1", False), ("group_log", True)])
def test_only_the_rate_weight_of_the_paper_does_not_depend_on_the_loss_of_frame_0(
    rate_model, is_relative
):
    context, state = make_context(), _make_state()
    start = FrameStart(state, begin_frame(state, 0), 0)
    settings = replace(_MOTION, rate_model=rate_model, rd_lambda=0.1, iterations=4)

    symbols = [
        np.concatenate(fit_motion(context, start, settings, rd=rd).symbols, axis=1)
        for rd in (RateDistortion(1.0, 1.0), RateDistortion(1.0, 0.001))
    ]

    assert np.array_equal(*symbols) != is_relative


def test_residuals_are_the_symbols_unless_rounding_is_off():
    context, state = make_context(), _make_state()
    start = FrameStart(state, begin_frame(state, 0), 0)

    rounded = fit_motion(context, start, _MOTION)
    with without_rounding():
        unrounded = fit_motion(context, start, _MOTION)

    symbols = np.concatenate(rounded.symbols, axis=1).T
    assert np.allclose(rounded.residuals.numpy(), symbols, atol=1e-4)
    fractions = unrounded.residuals.numpy() - np.concatenate(unrounded.symbols, axis=1).T
    assert np.count_nonzero(np.abs(fractions) > 0.01) > unrounded.residuals.numel() / 2
