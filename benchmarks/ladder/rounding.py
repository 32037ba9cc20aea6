"""Rounds a fitted rung to quantization steps; returns the rounded splats and the coded bytes."""

from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from torch import Tensor

from ladder.fitting import FitResult
from quarc_ref.decoder.dequantize import Splats, dequantize
from quarc_ref.decoder.reconstruct import motion_contexts, move
from quarc_ref.decoder.state import State
from quarc_ref.decoder.updates import apply_updates, update_context
from quarc_ref.encoder.training.straight_through import translation_step
from quarc_ref.encoder.training.trainable import Attributes, from_splats
from quarc_ref.format.arrays import Int64
from quarc_ref.format.coding.motion_planes import write_motion
from quarc_ref.format.coding.update_planes import write_updates
from quarc_ref.format.constants import (
    CODE_LIMIT,
    RECENCY_LIMIT,
    RESIDUAL_ROWS,
    ROTATION_UNITY_LIMIT,
    SYMBOL_LIMIT,
)
from quarc_ref.format.records import SH_REST, StreamHeader
from quarc_ref.format.updates import CODES, ROTATION, UPDATE_FIELDS, Updates
from quarc_ref.inspection.estimate import estimate_bits, estimate_updates

ChangeCounts = dict[str, int]  # number of Gaussians that change, by field

_MIN_W = 1e-6
_SH_REST_NAME = "SH rest"


@dataclass(frozen=True, slots=True, eq=False)
class RoundedResult:
    """The result of rounding a rung.

    Attributes:
        splats: The rounded splats.
        coded_bytes: Bytes of the coded symbols of the anchors, or of the coded updates without SH
            rest; the context counts are those of the start frame.
        estimated_bytes: Zero-order entropy of the updates in bytes; None if the rung moves anchors.
        rest_bytes: Zero-order entropy of the changes of SH rest in bytes; they are estimated
            because updates cannot contain SH rest.
        change_counts: Number of Gaussians that change, by field; the entry `any` counts Gaussians
            with at least one changed field, and `deaths` counts deleted Gaussians.
    """

    splats: Splats
    coded_bytes: int
    estimated_bytes: float | None
    rest_bytes: float
    change_counts: ChangeCounts


def allow_updates(state: State) -> State:
    """Return the state that the same scene would have in a stream that allows updates."""
    if state.scene.header.updates:
        return state
    header = replace(state.scene.header, updates=True)
    recency = np.full(state.scene.count, RECENCY_LIMIT, dtype=np.int16)
    return replace(state, scene=replace(state.scene, header=header), recency=recency)


def round_rung(frame_start: State, fit: FitResult) -> RoundedResult:
    """Round the result of a rung to quantization steps.

    Args:
        frame_start: Frame start from which the rung was fitted; a result of `allow_updates`.
        fit: Result of fitting the rung.

    Raises:
        StateError: A Gaussian leaves the lattice.
        EncodeError: A residual exceeds the range of the format.
    """
    if fit.symbols is not None:
        return _round_motion(frame_start, fit.symbols)
    levels = frame_start.required_anchors.levels
    planes = frame_start.scene.header.symbol_planes
    zero_symbols = [np.zeros((planes, level.owners.size), dtype=np.int64) for level in levels]
    return _round_updates(move(frame_start, zero_symbols), fit)


def to_splats(attributes: Attributes) -> Splats:
    """Convert attributes in floats to splats for rendering."""
    with torch.no_grad():
        quaternions = torch.nn.functional.normalize(attributes.rotations, dim=1)
        sh = torch.cat([attributes.sh_dc, attributes.sh_rest], dim=1)
        rows = (attributes.means, quaternions, attributes.log_scales, attributes.opacities, sh)
        return Splats(*(np.ascontiguousarray(row.cpu().numpy()) for row in rows))


def _round_motion(frame_start: State, symbols: list[Int64]) -> RoundedResult:
    clipped = [np.clip(level, -SYMBOL_LIMIT, SYMBOL_LIMIT) for level in symbols]
    section = write_motion(
        motion_contexts(frame_start, use_previous=False), clipped, frame_start.motion_counts
    )
    moved_state = move(frame_start, clipped)
    change_counts = {"any": int(np.any(moved_state.motion, axis=0).sum()), "deaths": 0}
    return RoundedResult(
        dequantize(moved_state.scene), section.byte_count(), None, 0.0, change_counts
    )


def _round_updates(moved_state: State, fit: FitResult) -> RoundedResult:
    updates, sh_rest = find_updates(moved_state, fit)
    section = write_updates(update_context(moved_state), updates, moved_state.update_counts)
    updated_scene = apply_updates(moved_state, updates).scene
    codes = updated_scene.codes.copy()
    survivors = fit.survivors.cpu().numpy()
    if codes.shape[0] > SH_REST.start:
        sh_rest_codes = codes[SH_REST].astype(np.int64) + sh_rest[:, survivors]
        codes[SH_REST] = np.clip(sh_rest_codes, -CODE_LIMIT, CODE_LIMIT).astype(np.int16)
    has_sh_rest_change = np.any(sh_rest, axis=0)
    change_counts = _count_changes(updates) | {_SH_REST_NAME: int(has_sh_rest_change.sum())}
    change_counts["any"] = int(
        np.union1d(updates.gaussians, np.flatnonzero(has_sh_rest_change)).size
    )
    estimated_bytes = estimate_updates(updates, moved_state.scene.count)
    bits = estimate_bits(has_sh_rest_change[None].astype(np.int64)) + estimate_bits(
        sh_rest[:, has_sh_rest_change]
    )
    splats = dequantize(replace(updated_scene, codes=codes))
    return RoundedResult(splats, section.byte_count(), estimated_bytes, bits / 8, change_counts)


def find_updates(moved_state: State, fit: FitResult) -> tuple[Updates, Int64]:
    """Return the rounded updates of a fitted rung, and the rounded changes `[9, N]` of SH rest."""
    scene, survivors = moved_state.scene, fit.survivors.cpu().numpy()
    start = from_splats(dequantize(scene), torch.device("cpu")).rows(fit.survivors.cpu())
    all_residuals = _find_all_residuals(start, fit.attributes, scene.header)
    sh_rest = np.zeros((SH_REST.stop - SH_REST.start, scene.count), dtype=np.int64)
    if scene.header.sh_degree:
        sh_rest[:, survivors] = all_residuals[RESIDUAL_ROWS:]
    residuals = np.zeros((RESIDUAL_ROWS, scene.count), dtype=np.int64)
    residuals[:, survivors] = all_residuals[:RESIDUAL_ROWS]
    residuals[ROTATION] = np.clip(residuals[ROTATION], -ROTATION_UNITY_LIMIT, ROTATION_UNITY_LIMIT)
    codes = scene.codes[: CODES.stop - CODES.start].astype(np.int64)
    residuals[CODES] = np.clip(codes + residuals[CODES], -CODE_LIMIT, CODE_LIMIT) - codes
    is_deleted = np.ones(scene.count, dtype=np.bool_)
    is_deleted[survivors] = False
    indices = np.flatnonzero(is_deleted | np.any(residuals, axis=0))
    return Updates(indices, is_deleted[indices], residuals[:, indices]), sh_rest


def _find_all_residuals(start: Attributes, end: Attributes, header: StreamHeader) -> Int64:
    """Return the attributes' changes `[13 + 9, K]` in quantization steps; SH rest is last."""
    rotations = _find_rotation_residuals(_to_floats(start.rotations), _to_floats(end.rotations))
    planes = [
        (_to_floats(end.means - start.means), translation_step(header)),
        (rotations, 1 / header.rotation_unity),
        (_to_floats(end.log_scales - start.log_scales), header.log_scale_step),
        (_to_floats(end.opacities - start.opacities), header.opacity_step),
        (_to_floats(end.sh_dc - start.sh_dc), header.sh_dc_step),
        (_to_floats(end.sh_rest - start.sh_rest), header.sh_rest_step),
    ]
    rows = [np.rint(values.reshape(len(values), -1).T / step) for values, step in planes]
    return np.concatenate(rows).astype(np.int64)


def _to_floats(tensor: Tensor) -> NDArray[np.float64]:
    floats: NDArray[np.float64] = tensor.detach().cpu().numpy().astype(np.float64)
    return floats


def _find_rotation_residuals(
    start: NDArray[np.float64], end: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the residuals `[K, 3]` of updates that rotate `start` to `end` (SPEC 7.8)."""
    first, last = (Rotation.from_quat(np.roll(rotations, -1, axis=1)) for rotations in (start, end))
    quaternions = (first.inv() * last).as_quat()
    w = quaternions[:, 3:]
    residuals: NDArray[np.float64] = quaternions[:, :3] / np.where(np.abs(w) < _MIN_W, _MIN_W, w)
    return residuals


def _count_changes(updates: Updates) -> ChangeCounts:
    change_counts = {
        name: int(np.any(updates.residuals[rows], axis=0).sum())
        for name, rows in UPDATE_FIELDS.items()
    }
    return change_counts | {"deaths": int(updates.dies.sum())}
