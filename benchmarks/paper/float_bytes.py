"""Computes the size of an unquantized frame, as raw float32 and by the method of the paper."""

import numpy as np

from paper.trials import Trial
from paper.unquantized import FloatFrame
from quarc_ref.decoder.scene import Scene
from quarc_ref.format.records import Gaussians
from quarc_ref.inspection.estimate import estimate_births, estimate_bits, estimate_gaussians
from quarc_ref.inspection.stream_summary import FrameSummary
from quarc_ref.inspection.symbols import MagnitudeHistograms

_FLOAT_BYTES = 4
_POSE_FLOATS = 7  # position and quaternion


def summarize_floats(float_frame: FloatFrame, trial: Trial) -> FrameSummary:
    """Return the summary of a frame of an unquantized trial.

    The paper estimates the size of floats as it does for symbols: a value takes -log2(p) bits,
    where p is the relative frequency of the value in its channel.
    """
    state = float_frame.state
    scene, births = state.scene, state.births
    birth_count = 0 if births is None else births.newborn.count
    is_canonical = not state.symbols
    anchor_count = sum(level.shape[1] for level in state.symbols)
    bytes_per_gaussian = _FLOAT_BYTES * (_POSE_FLOATS + scene.header.code_planes)
    coded_bytes = {
        "canonical": bytes_per_gaussian * scene.count if is_canonical else 0,
        "motion": _FLOAT_BYTES * scene.header.symbol_planes * anchor_count,
        **dict.fromkeys(("snapshots", "updates"), 0),  # the paper does not have any
        "births": bytes_per_gaussian * birth_count,
    }
    estimates = {
        "canonical": estimate_gaussians(_make_gaussians(scene)) if is_canonical else 0.0,
        "motion": 0.0 if is_canonical else estimate_float_bytes(state.symbols),
        **dict.fromkeys(("snapshots", "updates"), 0.0),
        "births": 0.0 if births is None else estimate_births(births),
    }
    return FrameSummary(
        scene.frame, is_canonical, scene.count, anchor_count, birth_count, float_frame.deaths, 0,
        sum(coded_bytes.values()), coded_bytes, estimates, MagnitudeHistograms((), ()), trial.name,
    )  # fmt: skip


def estimate_float_bytes(levels: tuple[np.ndarray, ...]) -> float:
    """Return the paper's size estimate, in bytes, of unrounded residuals `[c, a]` of all levels."""
    return estimate_bits(np.concatenate(levels, axis=1).astype(np.float32)) / 8


def _make_gaussians(scene: Scene) -> Gaussians:
    planes = (scene.positions, scene.rotations, scene.codes)
    return Gaussians(*(plane.astype(np.int64) for plane in planes))
