"""What a frame does to single Gaussians: SPEC 7.8.

Between the motion and the births some Gaussians leave by choice, and some are
moved, turned, stretched, made more or less opaque, or colored anew.
"""

from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from quarc_ref.decoder.anchors import Anchors
from quarc_ref.decoder.rotation import normalize_sums, turn
from quarc_ref.decoder.scene import Scene, remove
from quarc_ref.decoder.state import State
from quarc_ref.format.arrays import Int16, Int32, Int64
from quarc_ref.format.constants import (
    CODE_LIMIT,
    POSITION_LIMIT,
    RECENCY_LIMIT,
    ROTATION_UNITY_LIMIT,
)
from quarc_ref.format.errors import (
    CodeRangeError,
    CountError,
    PositionRangeError,
    SymbolRangeError,
)
from quarc_ref.format.update_planes import UpdateContext
from quarc_ref.format.updates import CODES, TRANSLATION, TURN, Updates

_Number = TypeVar("_Number", np.int16, np.int32, np.int64)


def update_context(state: State) -> UpdateContext:
    """Return what is known of a frame's Gaussians before its updates (SPEC 8.8).

    Args:
        state: After `move`, of a stream with updates.
    """
    return UpdateContext(state.motion, state.known_recency)


def update(state: State, updates: Updates, before: Scene | None = None) -> State:
    """Return the state with single Gaussians changed (SPEC 7.8).

    Args:
        state: After `move`, of a stream with updates.
        updates: In steps.
        before: Scene of the frame before, if the state is of no further use to anybody: then
            what the two do not share is written to and not copied.

    Raises:
        CountError: No Gaussian would be left.
        StateError: A position or a code is out of range.
        SymbolRangeError: A rotation residual is.
    """
    gone = updates.gaussians[updates.dies]
    if gone.size == state.scene.count:
        message = f"all {gone.size} Gaussians leave"
        raise CountError(message)
    recency = np.minimum(state.known_recency + 1, RECENCY_LIMIT).astype(np.int16)
    recency[updates.gaussians] = 0
    if updates.count == 0:
        return replace(state, recency=recency, updates=updates)
    left = updates.gaussians[~updates.dies]
    left -= np.searchsorted(gone, left)
    scene = _change(state, gone, left, updates.residuals[:, ~updates.dies], before)
    anchors = state.known_anchors
    binding = remove(anchors.binding, gone)
    return replace(
        state,
        scene=scene,
        anchors=Anchors(anchors.levels, binding),
        motion=_without(state.motion, gone, state.room),
        recency=remove(recency[None], gone)[0],
        updates=updates,
    )


def _change(
    state: State, gone: Int64, left: Int64, residuals: Int64, before: Scene | None
) -> Scene:
    """Return the scene without the Gaussians `[g]`, those of indices `[n]` then changed."""
    scene, room = state.scene, state.room

    def fresh(planes: NDArray[_Number], shared: NDArray[_Number] | None) -> NDArray[_Number]:
        if before is not None and planes is not shared and gone.size == 0:
            return planes
        return _fresh(planes, gone, room)

    positions = fresh(scene.positions, None)
    rotations = fresh(scene.rotations, None)
    codes = fresh(scene.codes, None if before is None else before.codes)
    ids = _without(scene.ids[None], gone, room)[0]
    positions[:, left] = _moved(positions[:, left], residuals[TRANSLATION], scene)
    turning = np.flatnonzero(np.any(residuals[TURN], axis=0))
    turned = left[turning]
    rotations[:, turned] = _turned(rotations[:, turned], residuals[TURN, turning], scene)
    kept = codes[: CODES.stop - CODES.start]
    kept[:, left] = _coded(kept[:, left], residuals[CODES])
    return replace(scene, ids=ids, positions=positions, rotations=rotations, codes=codes)


def _fresh(planes: NDArray[_Number], gone: Int64, room: int) -> NDArray[_Number]:
    """Return planes without columns `[g]`, with room behind them, that may be written to."""
    return remove(planes, gone, room) if gone.size or room else planes.copy()


def _without(planes: NDArray[_Number], gone: Int64, room: int) -> NDArray[_Number]:
    """Return planes without columns `[g]`, with the room behind them that they had."""
    return remove(planes, gone, room) if gone.size else planes


def _moved(positions: Int32, residuals: Int64, scene: Scene) -> Int32:
    moved = positions + residuals * scene.header.translation_step
    if np.abs(moved).max(initial=0) > POSITION_LIMIT:
        message = "an update takes a Gaussian off the lattice"
        raise PositionRangeError(message)
    return moved.astype(np.int32)


def _turned(rotations: Int32, residuals: Int64, scene: Scene) -> Int32:
    if np.abs(residuals).max(initial=0) > ROTATION_UNITY_LIMIT:
        message = f"a rotation residual of an update is beyond {ROTATION_UNITY_LIMIT}"
        raise SymbolRangeError(message)
    identity = np.full_like(residuals[:1], scene.header.rotation_unity)
    return turn(rotations, normalize_sums(np.concatenate([identity, residuals])))


def _coded(codes: Int16, residuals: Int64) -> Int16:
    changed = codes + residuals
    if np.abs(changed).max(initial=0) > CODE_LIMIT:
        message = "an update takes an attribute code out of its range"
        raise CodeRangeError(message)
    return changed.astype(np.int16)
