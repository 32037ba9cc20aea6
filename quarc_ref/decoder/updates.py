"""Applies the updates of individual Gaussians in a frame: SPEC 7.8.

After the motion and before the births of a frame, updates delete individual Gaussians or
change their position, rotation, scale, opacity or color.
"""

from dataclasses import replace

import numpy as np

from quarc_ref.decoder.ranges import narrow_codes, narrow_positions
from quarc_ref.decoder.rotation import normalize_sums, rotate
from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.state import State
from quarc_ref.format.arrays import Int32, Int64
from quarc_ref.format.coding.update_planes import UpdateContext
from quarc_ref.format.constants import RECENCY_LIMIT, ROTATION_UNITY_LIMIT
from quarc_ref.format.errors import CountError, SymbolRangeError
from quarc_ref.format.updates import CODES, ROTATION, TRANSLATION, Updates


def update_context(state: State) -> UpdateContext:
    """Return the data that selects the contexts of a frame's updates (SPEC 8.8).

    Args:
        state: State after `move`; the stream must have updates.
    """
    return UpdateContext(state.motion, state.required_recency)


def apply_updates(state: State, updates: Updates) -> State:
    """Return the state with individual Gaussians changed or deleted (SPEC 7.8).

    Args:
        state: State after `move`; the stream must have updates.
        updates: Updates in quantization steps.

    Raises:
        CountError: No Gaussian would remain.
        StateError: A position or a code is out of range.
        SymbolRangeError: A rotation residual is out of range.
    """
    deleted = updates.gaussians[updates.dies]
    if deleted.size == state.scene.count:  # [7.8-1]
        message = f"the updates delete all {deleted.size} Gaussians"
        raise CountError(message)
    recency = np.minimum(state.required_recency + 1, RECENCY_LIMIT).astype(np.int16)
    recency[updates.gaussians] = 0
    survives = ~updates.dies
    surviving = updates.gaussians[survives]
    surviving -= np.searchsorted(deleted, surviving)
    scene = state.scene.without(deleted)
    return replace(
        state,
        scene=_add_residuals(scene, surviving, updates.residuals[:, survives]),
        anchors=state.required_anchors.without(deleted),
        motion=np.delete(state.motion, deleted, axis=1),
        recency=np.delete(recency, deleted),
        updates=updates,
    )


def _add_residuals(scene: Scene, indices: Int64, residuals: Int64) -> Scene:
    """Return the scene with residuals `[13, n]` added to the Gaussians at indices `[n]`."""
    positions, rotations, codes = (
        scene.positions.copy(),
        scene.rotations.copy(),
        scene.codes.copy(),
    )
    new_positions = positions[:, indices] + residuals[TRANSLATION] * scene.header.translation_step
    positions[:, indices] = narrow_positions(new_positions)  # [7.8-2]
    rotated_columns = np.flatnonzero(np.any(residuals[ROTATION], axis=0))
    rotated = indices[rotated_columns]
    rotations[:, rotated] = _rotate_by_residuals(
        rotations[:, rotated], residuals[ROTATION, rotated_columns], scene
    )
    changed_codes = codes[: CODES.stop - CODES.start]  # all codes except SH rest
    new_codes = changed_codes[:, indices] + residuals[CODES]
    changed_codes[:, indices] = narrow_codes(new_codes)  # [7.8-3]
    return replace(scene, positions=positions, rotations=rotations, codes=codes)


def _rotate_by_residuals(rotations: Int32, residuals: Int64, scene: Scene) -> Int32:
    if np.abs(residuals).max(initial=0) > ROTATION_UNITY_LIMIT:  # [7.8-4]
        message = f"a rotation residual of an update exceeds {ROTATION_UNITY_LIMIT}"
        raise SymbolRangeError(message)
    identity = np.full_like(residuals[:1], scene.header.rotation_unity)
    return rotate(rotations, normalize_sums(np.concatenate([identity, residuals])))
