"""The size of a frame in floats: raw float32, and the paper's estimate."""

import numpy as np

from paper.trials import Trial
from paper.unquantized import FloatFrame
from quarc_ref.decoder.scene import Scene
from quarc_ref.format.records import Gaussians
from quarc_ref.inspection.estimate import estimate_births, estimate_bits, estimate_gaussians
from quarc_ref.inspection.stream_summary import FrameSummary
from quarc_ref.inspection.symbols import Magnitudes

_FLOAT_BYTES = 4
_FLOATS_OF_PLACE = 7  # position and quaternion


def summarize_floats(made: FloatFrame, trial: Trial) -> FrameSummary:
    """Return the parts of a frame of a trial in floats.

    The paper estimates floats like symbols: for each channel, the sum of -log2 of the share of each
    value. Values without a quantization step are counted like that.
    """
    state = made.state
    scene, births = state.scene, state.births
    newborn = 0 if births is None else births.newborn.count
    canonical = not state.symbols
    anchors = sum(level.shape[1] for level in state.symbols)
    each = _FLOAT_BYTES * (_FLOATS_OF_PLACE + scene.header.code_planes)
    coded = {
        "canonical": each * scene.count if canonical else 0,
        "motion": _FLOAT_BYTES * scene.header.symbol_planes * anchors,
        **dict.fromkeys(("snapshots", "updates"), 0),  # the paper does not have any
        "births": each * newborn,
    }
    price = {
        "canonical": estimate_gaussians(_as_gaussians(scene)) if canonical else 0.0,
        "motion": 0.0 if canonical else estimate_floats(state.symbols),
        **dict.fromkeys(("snapshots", "updates"), 0.0),
        "births": 0.0 if births is None else estimate_births(births),
    }
    return FrameSummary(
        scene.frame, canonical, scene.count, anchors, newborn, made.deaths, 0,
        sum(coded.values()), coded, price, Magnitudes((), ()), trial.name,
    )  # fmt: skip


def estimate_floats(levels: tuple[np.ndarray, ...]) -> float:
    """Return the paper's estimate in bytes of unrounded residuals `[c, a]` of each level."""
    return estimate_bits(np.concatenate(levels, axis=1).astype(np.float32)) / 8


def _as_gaussians(scene: Scene) -> Gaussians:
    planes = (scene.positions, scene.rotations, scene.codes)
    return Gaussians(*(plane.astype(np.int64) for plane in planes))
