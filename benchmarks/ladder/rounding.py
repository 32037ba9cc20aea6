"""Rounds a fitted rung to the steps of the codes; gives its decoded form and its bytes."""

from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from torch import Tensor

from ladder.fitting import Fitted
from quarc_ref.decoder.dequantize import Splats, dequantize
from quarc_ref.decoder.reconstruct import motion_contexts, move
from quarc_ref.decoder.state import State
from quarc_ref.decoder.updates import update, update_context
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

Changes = dict[str, int]  # numbers of Gaussians of which a field changes, by its name

_MIN_W = 1e-6
_REST_NAME = "SH rest"


@dataclass(frozen=True, slots=True, eq=False)
class Rounded:
    """A rounded rung.

    Attributes:
        splats: As decoded.
        coded_bytes: Bytes of the anchors' symbols, or of updates without SH rest, as coded by the
            format with empty contexts.
        estimated_bytes: Zero-order estimate of the same updates; None for anchors.
        rest_bytes: Zero-order estimate of SH rest, which updates do not contain.
        changed: Number of Gaussians that change: under `any`, and for each field; `deaths` is the
            number of deleted ones.
    """

    splats: Splats
    coded_bytes: int
    estimated_bytes: float | None
    rest_bytes: float
    changed: Changes


def allow_updates(state: State) -> State:
    """Return a state as in a stream with updates, with empty updates if it has none."""
    if state.scene.header.updates:
        return state
    header = replace(state.scene.header, updates=True)
    recency = np.full(state.scene.count, RECENCY_LIMIT, dtype=np.int16)
    return replace(state, scene=replace(state.scene, header=header), recency=recency)


def round_rung(started: State, fitted: Fitted) -> Rounded:
    """Round the result of a rung to steps.

    Args:
        started: Frame start that the rung was fitted from, of `allow_updates`.
        fitted: The rung.

    Raises:
        StateError: A Gaussian is off the lattice.
        EncodeError: A residual exceeds the range of the format.
    """
    if fitted.symbols is not None:
        return _round_motion(started, fitted.symbols)
    levels = started.known_anchors.levels
    planes = started.scene.header.symbol_planes
    unmoved = [np.zeros((planes, level.owners.size), dtype=np.int64) for level in levels]
    return _round_updates(move(started, unmoved), fitted)


def to_splats(attributes: Attributes) -> Splats:
    """Convert attributes in floats to the splats that evaluation renders."""
    with torch.no_grad():
        unit = torch.nn.functional.normalize(attributes.rotations, dim=1)
        sh = torch.cat([attributes.sh_dc, attributes.sh_rest], dim=1)
        rows = (attributes.means, unit, attributes.log_scales, attributes.opacities, sh)
        return Splats(*(np.ascontiguousarray(each.cpu().numpy()) for each in rows))


def _round_motion(started: State, symbols: list[Int64]) -> Rounded:
    within = [np.clip(level, -SYMBOL_LIMIT, SYMBOL_LIMIT) for level in symbols]
    section = write_motion(motion_contexts(started, previous=False), within, started.motion_counts)
    moved = move(started, within)
    changed = {"any": int(np.any(moved.motion, axis=0).sum()), "deaths": 0}
    return Rounded(dequantize(moved.scene), section.byte_count(), None, 0.0, changed)


def _round_updates(moved: State, fitted: Fitted) -> Rounded:
    updates, rest = find_updates(moved, fitted)
    section = write_updates(update_context(moved), updates, moved.update_counts)
    left = update(moved, updates).scene
    codes = left.codes.copy()
    alive = fitted.alive.cpu().numpy()
    if codes.shape[0] > SH_REST.start:
        wide = codes[SH_REST].astype(np.int64) + rest[:, alive]
        codes[SH_REST] = np.clip(wide, -CODE_LIMIT, CODE_LIMIT).astype(np.int16)
    there = np.any(rest, axis=0)
    changed = _count_changes(updates) | {_REST_NAME: int(there.sum())}
    changed["any"] = int(np.union1d(updates.gaussians, np.flatnonzero(there)).size)
    estimated = estimate_updates(updates, moved.scene.count)
    bits = estimate_bits(there[None].astype(np.int64)) + estimate_bits(rest[:, there])
    splats = dequantize(replace(left, codes=codes))
    return Rounded(splats, section.byte_count(), estimated, bits / 8, changed)


def find_updates(moved: State, fitted: Fitted) -> tuple[Updates, Int64]:
    """Return the updates nearest to a fitted rung, and the `[9, N]` of SH rest that they lack."""
    scene, alive = moved.scene, fitted.alive.cpu().numpy()
    start = from_splats(dequantize(scene), torch.device("cpu")).rows(fitted.alive.cpu())
    found = _find_residuals(start, fitted.attributes, scene.header)
    rest = np.zeros((SH_REST.stop - SH_REST.start, scene.count), dtype=np.int64)
    if scene.header.sh_degree:
        rest[:, alive] = found[RESIDUAL_ROWS:]
    residuals = np.zeros((RESIDUAL_ROWS, scene.count), dtype=np.int64)
    residuals[:, alive] = found[:RESIDUAL_ROWS]
    residuals[ROTATION] = np.clip(residuals[ROTATION], -ROTATION_UNITY_LIMIT, ROTATION_UNITY_LIMIT)
    codes = scene.codes[: CODES.stop - CODES.start].astype(np.int64)
    residuals[CODES] = np.clip(codes + residuals[CODES], -CODE_LIMIT, CODE_LIMIT) - codes
    dies = np.ones(scene.count, dtype=np.bool_)
    dies[alive] = False
    chosen = np.flatnonzero(dies | np.any(residuals, axis=0))
    return Updates(chosen, dies[chosen], residuals[:, chosen]), rest


def _find_residuals(before: Attributes, after: Attributes, header: StreamHeader) -> Int64:
    """Return `[13 + 9, K]` differences of attributes in steps; SH rest is last."""
    turns = _find_turns(_to_floats(before.rotations), _to_floats(after.rotations))
    planes = [
        (_to_floats(after.means - before.means), translation_step(header)),
        (turns, 1 / header.rotation_unity),
        (_to_floats(after.log_scales - before.log_scales), header.log_scale_step),
        (_to_floats(after.opacities - before.opacities), header.opacity_step),
        (_to_floats(after.sh_dc - before.sh_dc), header.sh_dc_step),
        (_to_floats(after.sh_rest - before.sh_rest), header.sh_rest_step),
    ]
    rows = [np.rint(values.reshape(len(values), -1).T / step) for values, step in planes]
    return np.concatenate(rows).astype(np.int64)


def _to_floats(tensor: Tensor) -> NDArray[np.float64]:
    floats: NDArray[np.float64] = tensor.detach().cpu().numpy().astype(np.float64)
    return floats


def _find_turns(before: NDArray[np.float64], after: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return `[K, 3]` the updates that turn rotations `[K, 4]` into others (SPEC 7.8)."""
    first, last = (Rotation.from_quat(np.roll(each, -1, axis=1)) for each in (before, after))
    quaternions = (first.inv() * last).as_quat()
    w = quaternions[:, 3:]
    turns: NDArray[np.float64] = quaternions[:, :3] / np.where(np.abs(w) < _MIN_W, _MIN_W, w)
    return turns


def _count_changes(updates: Updates) -> Changes:
    changed = {
        name: int(np.any(updates.residuals[rows], axis=0).sum())
        for name, rows in UPDATE_FIELDS.items()
    }
    return changed | {"deaths": int(updates.dies.sum())}
