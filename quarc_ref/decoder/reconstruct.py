"""Computes the state of a frame from the state of the previous frame: SPEC 7.4 to 7.6.

    deaths ──> begin_frame ──> move ──> apply_updates ──> append_births ──> state of the frame
               (SPEC 7.4)      (7.5)    (7.8)             (7.6)

Each step takes a state and returns a new one, without changing its arguments.
"""

from dataclasses import replace

import numpy as np

from quarc_ref.decoder.anchors import sample_anchors
from quarc_ref.decoder.ranges import narrow_codes, narrow_positions
from quarc_ref.decoder.rotation import expand_rotations, normalize_sums, rotate
from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.state import State
from quarc_ref.format.arrays import Int16, Int32, Int64
from quarc_ref.format.coding.motion_planes import LevelContext
from quarc_ref.format.constants import COUNTER_LIMIT
from quarc_ref.format.errors import CountError, CountLevelError, ParentRangeError
from quarc_ref.format.records import OPACITY, Births


def begin_frame(state: State, death_count: int) -> State:
    """Delete `death_count` Gaussians, and bind the others to anchors (SPEC 7.4).

    Args:
        state: State of the previous frame.
        death_count: Number of Gaussians to delete; `choose_deaths` chooses them.

    Raises:
        CountError: No Gaussian would remain.
    """
    previous_scene = state.scene
    if death_count >= previous_scene.count:  # [7.4-3]
        message = f"{death_count} deaths in a scene of {previous_scene.count} Gaussians"
        raise CountError(message)
    deleted = choose_deaths(previous_scene, death_count)
    scene = replace(
        previous_scene.without(deleted),
        frame=previous_scene.frame + 1,
        phase=previous_scene.phase + 1,
    )
    anchors = state.anchors
    if anchors is None or previous_scene.phase % previous_scene.header.resample_interval == 0:
        anchors = sample_anchors(scene)
    else:
        previously_bound_count = anchors.binding.shape[1]
        anchors = anchors.without(deleted[deleted < previously_bound_count])
        anchors = anchors.with_births(scene.positions[:, anchors.binding.shape[1] :])
    return replace(
        state,
        scene=scene,
        motion=np.delete(state.motion, deleted, axis=1),
        recency=None if state.recency is None else np.delete(state.recency, deleted),
        symbols=(),
        anchors=anchors,
        births=None,
        updates=None,
    )


def choose_deaths(scene: Scene, count: int) -> Int64:
    """Return the `count` least opaque Gaussians; of equal ones, those with lower ids (SPEC 7.4)."""
    order = np.argsort(scene.codes[OPACITY.start], kind="stable")
    return order[:count]


def motion_contexts(state: State, *, use_previous: bool) -> list[LevelContext]:
    """Return, for every level, the data that selects the contexts of its symbols (SPEC 8.7).

    Args:
        state: State after `begin_frame`.
        use_previous: Whether the contexts depend on the motion of the previous frame.
    """
    contexts = []
    for level in state.required_anchors.levels:
        level_motion = look_up_motion(state, level.owners)
        contexts.append(
            LevelContext(
                level.parents, level_motion if use_previous else np.zeros_like(level_motion)
            )
        )
    return contexts


def look_up_motion(state: State, owners: Int64) -> Int16:
    """Return the previous frame's `[c, a]` motion of Gaussians with ids `[a]`; 0 if deleted."""
    indices = np.minimum(np.searchsorted(state.scene.ids, owners), state.scene.count - 1)
    is_alive = state.scene.ids[indices] == owners
    motion: Int16 = state.motion[:, indices] * is_alive
    return motion


def move(state: State, symbols: list[Int64]) -> State:
    """Return the state with every Gaussian moved by its anchors (SPEC 7.5, Eq. 2 of the paper).

    Args:
        state: State after `begin_frame`.
        symbols: `[c, a]` symbols of each level, level 1 first.

    Raises:
        PositionRangeError: A Gaussian would be off the lattice.
        DegenerateRotationError: The residual quaternions of a Gaussian sum to zero.
    """
    scene = state.scene
    symbols_and_binding = zip(symbols, state.required_anchors.binding, strict=True)
    sums = np.sum(
        [level_symbols[:, binding] for level_symbols, binding in symbols_and_binding], axis=0
    )
    positions = scene.positions + sums[:3] * scene.header.translation_step
    return replace(
        state,
        scene=replace(
            scene,
            positions=narrow_positions(positions),  # [7.5-1]
            rotations=_rotate_all(scene, sums[3:]),
        ),
        motion=sums.astype(np.int16),
        symbols=tuple(symbols),
    )


def append_births(state: State, births: Births) -> State:
    """Return the state with the new Gaussians of a frame appended (SPEC 7.6).

    Args:
        state: State after `move` and, in a stream with updates, `updates.apply_updates`.
        births: New Gaussians, in quantization steps; `limits.check_birth_count` has checked their
            number.

    Raises:
        CountLevelError: No ids are left.
        StateError: A parent, a position, a code or a rotation is out of range.
    """
    scene, header, newborn = state.scene, state.scene.header, births.newborn
    if newborn.count == 0:
        return replace(state, births=births)
    if state.next_id + newborn.count > COUNTER_LIMIT + 1:  # [7.6-5]
        message = "no ids are left for new Gaussians"
        raise CountLevelError(message)
    if np.any(births.parents >= scene.count):  # [7.6-1]
        message = "the parent of a new Gaussian is not in the scene"
        raise ParentRangeError(message)
    positions = scene.positions[:, births.parents] + newborn.positions * header.position_step
    rotations = expand_rotations(newborn.rotations, header.rotation_bits)  # [7.6-4]
    extended = replace(
        scene,
        ids=np.append(scene.ids, state.next_id + np.arange(newborn.count)),
        codes=np.hstack([scene.codes, narrow_codes(newborn.codes)]),  # [7.6-3]
        positions=np.hstack([scene.positions, narrow_positions(positions)]),  # [7.6-2]
        rotations=np.hstack([scene.rotations, rotations]),
    )
    recency = state.recency
    if recency is not None:
        recency = np.append(recency, np.zeros(newborn.count, dtype=np.int16))
    no_motion = np.zeros((header.symbol_planes, newborn.count), dtype=np.int16)
    return replace(
        state,
        scene=extended,
        motion=np.hstack([state.motion, no_motion]),
        recency=recency,
        births=births,
        next_id=state.next_id + newborn.count,
    )


def _rotate_all(scene: Scene, sums: Int64) -> Int32:
    """Rotate every Gaussian whose rotation symbols do not sum to zero (SPEC 7.5)."""
    header = scene.header
    rotated = np.flatnonzero(np.any(sums, axis=0))
    if header.rotation_components == _COMPONENTS_WITHOUT_W:
        sums = np.vstack([np.zeros_like(sums[:1]), sums])
    sums = sums[:, rotated]
    sums[0] += header.rotation_unity * header.level_count
    rotations = scene.rotations.copy()
    rotations[:, rotated] = rotate(scene.rotations[:, rotated], normalize_sums(sums))
    return rotations


_COMPONENTS_WITHOUT_W = 3
