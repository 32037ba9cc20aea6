"""What a frame in floats would weigh: float32 as it is, and the paper's price of it."""

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
    """Return what a frame of a trial in floats is made of.

    The paper's price of floats is that of any symbols: of each channel, the sum
    of -log2 of every value's share. What is left in no steps is counted as it is.
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
        **dict.fromkeys(("snapshots", "updates"), 0),  # the paper has none
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
    """Return the paper's price of residuals `[c, a]` of each level that are in no steps, bytes."""
    return estimate_bits(np.concatenate(levels, axis=1).astype(np.float32)) / 8


def _as_gaussians(scene: Scene) -> Gaussians:
    planes = (scene.positions, scene.rotations, scene.codes)
    return Gaussians(*(plane.astype(np.int64) for plane in planes))
