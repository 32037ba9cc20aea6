"""Fits updates of individual Gaussians after the motion (SPEC 7.8).

A Gaussian that no update can bring within the bounds is deleted, and coded again as a birth.
"""

from dataclasses import dataclass

import numpy as np

from quarc_ref.decoder.engine import FrameState
from quarc_ref.encoder.scenes.bounds import Bounds
from quarc_ref.encoder.scenes.rotations import Float64, angles_between, rotations_between
from quarc_ref.encoder.scenes.targets import Target
from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.constants import (
    CODE_LIMIT,
    RESIDUAL_ROWS,
    ROTATION_ONE,
    ROTATION_UNITY_LIMIT,
)
from quarc_ref.format.records import LOG_SCALES, OPACITY, SH_DC, SH_REST, StreamHeader
from quarc_ref.format.updates import ROTATION, TRANSLATION, UPDATE_FIELDS, Updates

_ROUNDING = 1 + 1e-6  # tolerance for float errors in comparisons with a bound
_FIELDS = {"log-scales": LOG_SCALES, "opacity": OPACITY, "SH DC": SH_DC}


@dataclass(frozen=True, slots=True)
class CodeErrorBounds:
    """Error bounds of codes, in code steps.

    Attributes:
        fields: Bounds by the name of the field of an update.
        sh_rest: Bound of SH rest, which updates cannot change.
    """

    fields: dict[str, float]
    sh_rest: float


def bound_codes(bounds: Bounds, header: StreamHeader) -> CodeErrorBounds:
    """Convert bounds to the quantization steps of a stream."""
    return CodeErrorBounds(
        {
            "log-scales": bounds.log_scale / header.log_scale_step * _ROUNDING,
            "opacity": bounds.opacity / header.opacity_step * _ROUNDING,
            "SH DC": bounds.sh_dc / header.sh_dc_step * _ROUNDING,
        },
        bounds.sh_rest / header.sh_rest_step * _ROUNDING,
    )


def find_recolored(state: FrameState, target: Target, rows: Int64, bounds: CodeErrorBounds) -> Bits:
    """Return `[N]` whether view-dependent color is out of bounds, which updates cannot change.

    Args:
        state: Any state of the frame.
        target: The frame.
        rows: `[N]` row of the target for each Gaussian; -1 for none.
        bounds: Error bounds, in code steps.
    """
    found = np.zeros(rows.size, dtype=np.bool_)
    if state.scene.header.sh_degree:
        kept = np.flatnonzero(rows >= 0)
        errors = target.codes[SH_REST, rows[kept]] - state.scene.codes[SH_REST, kept]
        found[kept] = np.abs(errors).max(axis=0) > bounds.sh_rest
    return found


def fit_updates(
    moved: FrameState, target: Target, rows: Int64, bounds: Bounds
) -> tuple[Updates, Bits]:
    """Return the updates of a frame, and the Gaussians that they delete.

    Two kinds of Gaussians are deleted: those without a row in the target, and those that no
    update can bring within the bounds.

    Args:
        moved: State after the motion.
        target: The frame.
        rows: `[N]` row of the target for each Gaussian; -1 for those to delete.
        bounds: Largest allowed errors.
    """
    scene, header = moved.scene, moved.scene.header
    kept = np.flatnonzero(rows >= 0)
    wanted = rows[kept]
    residuals = np.zeros((RESIDUAL_ROWS, rows.size), dtype=np.int64)
    apart = target.positions[:, wanted] - scene.positions[:, kept]
    slack = target.slack.rows(wanted)
    most = bounds.position * slack.position * _ROUNDING
    off = np.abs(apart).max(axis=0) * 2.0**-header.lattice_exponent > most
    residuals[TRANSLATION, kept] = np.rint(apart / header.translation_step) * off
    turned = scene.rotations[:, kept] / ROTATION_ONE
    residuals[ROTATION, kept], lost = _fit_turns(
        turned, target.rotations[:, wanted], bounds.rotation * slack.rotation, header
    )
    limits = bound_codes(bounds, header)
    for name, planes in _FIELDS.items():
        errors = target.codes[planes, wanted] - scene.codes[planes, kept]
        off = np.abs(errors).max(axis=0) > limits.fields[name]
        residuals[UPDATE_FIELDS[name], kept] = np.rint(errors) * off
    leaves = rows < 0
    leaves[kept] |= lost | (np.abs(residuals[:, kept]).max(axis=0) > CODE_LIMIT)
    chosen = np.flatnonzero(np.any(residuals, axis=0) | leaves)
    dies = leaves[chosen]
    return Updates(chosen, dies, residuals[:, chosen] * ~dies), leaves


def _fit_turns(
    before: Float64, wanted: Float64, bounds: Float64, header: StreamHeader
) -> tuple[Int64, Bits]:
    """Return `[3, n]` rotation residuals, and which Gaussians remain out of bounds."""
    off = angles_between(before, wanted) > bounds * _ROUNDING
    turns = rotations_between(before, wanted)
    residuals = header.rotation_unity * turns[1:] / np.maximum(turns[0], 1e-9)
    residuals = np.rint(np.clip(residuals, -ROTATION_UNITY_LIMIT, ROTATION_UNITY_LIMIT)) * off
    left = np.concatenate([np.full((1, off.size), float(header.rotation_unity)), residuals])
    left /= np.sqrt((left * left).sum(axis=0))
    lost = off & (angles_between(left, turns) > bounds)
    return residuals.astype(np.int64), lost
