"""Fits updates of individual Gaussians after the motion (SPEC 7.8).

If no update can bring a Gaussian within the bounds, an update deletes the Gaussian, and it is
coded again as a birth.
"""

from dataclasses import dataclass

import numpy as np

from quarc_ref.decoder.engine import FrameState
from quarc_ref.encoder.rotations import Float64, angles_between, rotations_between
from quarc_ref.encoder.scenes.bounds import Bounds
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

_ROUNDING_FACTOR = 1 + 1e-6  # loosens bounds for rounding errors of floats
_CODE_FIELDS = {"log-scales": LOG_SCALES, "opacity": OPACITY, "SH DC": SH_DC}


@dataclass(frozen=True, slots=True)
class CodeErrorBounds:
    """Error bounds of codes, in quantization steps.

    Attributes:
        fields: Bounds of the codes that updates can change, by name of the update field.
        sh_rest: Bound of the codes of SH rest, which updates cannot change.
    """

    fields: dict[str, float]
    sh_rest: float


def convert_code_bounds(bounds: Bounds, header: StreamHeader) -> CodeErrorBounds:
    """Convert the bounds of scales, opacity and SH to quantization steps."""
    return CodeErrorBounds(
        {
            "log-scales": bounds.log_scale / header.log_scale_step * _ROUNDING_FACTOR,
            "opacity": bounds.opacity / header.opacity_step * _ROUNDING_FACTOR,
            "SH DC": bounds.sh_dc / header.sh_dc_step * _ROUNDING_FACTOR,
        },
        bounds.sh_rest / header.sh_rest_step * _ROUNDING_FACTOR,
    )


def find_recolored(state: FrameState, target: Target, rows: Int64, bounds: CodeErrorBounds) -> Bits:
    """Return a mask `[N]` of the Gaussians whose SH rest is out of bounds.

    Updates cannot change SH rest, so these Gaussians must be coded again as births.

    Args:
        state: State with the Gaussians that `rows` maps to the target.
        target: Gaussians that the frame approximates.
        rows: `[N]` row of the target for each Gaussian; -1 for Gaussians to delete.
        bounds: Error bounds, in quantization steps.
    """
    is_recolored = np.zeros(rows.size, dtype=np.bool_)
    if state.scene.header.sh_degree:
        matched_indices = np.flatnonzero(rows >= 0)
        errors = (
            target.codes[SH_REST, rows[matched_indices]]
            - state.scene.codes[SH_REST, matched_indices]
        )
        is_recolored[matched_indices] = np.abs(errors).max(axis=0) > bounds.sh_rest
    return is_recolored


def fit_updates(
    moved_state: FrameState, target: Target, rows: Int64, bounds: Bounds
) -> tuple[Updates, Bits]:
    """Return the updates of a frame, and a mask `[N]` of the Gaussians that they delete.

    The updates delete Gaussians that have no row in the target, and Gaussians that no update
    can bring within the bounds.

    Args:
        moved_state: State after the motion.
        target: Gaussians that the frame approximates.
        rows: `[N]` row of the target for each Gaussian; -1 for Gaussians to delete.
        bounds: Largest allowed errors.
    """
    scene, header = moved_state.scene, moved_state.scene.header
    matched_indices = np.flatnonzero(rows >= 0)
    target_rows = rows[matched_indices]
    residuals = np.zeros((RESIDUAL_ROWS, rows.size), dtype=np.int64)
    offsets = target.positions[:, target_rows] - scene.positions[:, matched_indices]
    slack = target.slack.select(target_rows)
    position_limits = bounds.position * slack.position * _ROUNDING_FACTOR
    is_out_of_bounds = np.abs(offsets).max(axis=0) * 2.0**-header.lattice_exponent > position_limits
    residuals[TRANSLATION, matched_indices] = (
        np.rint(offsets / header.translation_step) * is_out_of_bounds
    )
    rotations = scene.rotations[:, matched_indices] / ROTATION_ONE
    residuals[ROTATION, matched_indices], is_unreachable = _fit_rotations(
        rotations, target.rotations[:, target_rows], bounds.rotation * slack.rotation, header
    )
    code_bounds = convert_code_bounds(bounds, header)
    for name, planes in _CODE_FIELDS.items():
        errors = target.codes[planes, target_rows] - scene.codes[planes, matched_indices]
        is_out_of_bounds = np.abs(errors).max(axis=0) > code_bounds.fields[name]
        residuals[UPDATE_FIELDS[name], matched_indices] = np.rint(errors) * is_out_of_bounds
    is_deleted = rows < 0
    is_deleted[matched_indices] |= is_unreachable | (
        np.abs(residuals[:, matched_indices]).max(axis=0) > CODE_LIMIT
    )
    indices = np.flatnonzero(np.any(residuals, axis=0) | is_deleted)
    dies = is_deleted[indices]
    return Updates(indices, dies, residuals[:, indices] * ~dies), is_deleted


def find_faint_deaths(state: FrameState, should_delete: Bits) -> Int64:
    """Return the Gaussians to delete that are fainter than all Gaussians to keep.

    A frame can delete its faintest Gaussians by storing only their number, so no updates are
    needed to delete the returned Gaussians.
    """
    order = np.argsort(state.scene.codes[OPACITY.start], kind="stable")
    survivor_ranks = np.flatnonzero(~should_delete[order])
    return order[: survivor_ranks[0] if survivor_ranks.size else 0]


def _fit_rotations(
    rotations: Float64, targets: Float64, bounds: Float64, header: StreamHeader
) -> tuple[Int64, Bits]:
    """Return `[3, n]` rotation residuals, and a mask of Gaussians that remain out of bounds."""
    is_out_of_bounds = angles_between(rotations, targets) > bounds * _ROUNDING_FACTOR
    differences = rotations_between(rotations, targets)
    residuals = header.rotation_unity * differences[1:] / np.maximum(differences[0], 1e-9)
    residuals = (
        np.rint(np.clip(residuals, -ROTATION_UNITY_LIMIT, ROTATION_UNITY_LIMIT)) * is_out_of_bounds
    )
    coded_differences = np.concatenate(
        [np.full((1, is_out_of_bounds.size), float(header.rotation_unity)), residuals]
    )
    coded_differences /= np.sqrt((coded_differences * coded_differences).sum(axis=0))
    is_unreachable = is_out_of_bounds & (angles_between(coded_differences, differences) > bounds)
    return residuals.astype(np.int64), is_unreachable
