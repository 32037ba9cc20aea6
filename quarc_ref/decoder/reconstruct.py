"""What a frame does to the state: SPEC 7, the one normative copy.

    canonical ──> begin_canonical ─────────────────────────────┐
    deaths ─────> begin_frame ──> move ──> update ──> bear ──> state of the frame
                  (SPEC 7.4)      (7.5)    (7.8)      (7.6)

The encoder's closed loop calls these very functions; there is no second
reconstruction.
"""

from dataclasses import replace

import numpy as np

from quarc_ref.decoder.anchors import AnchorLevel, Anchors, bind_newborn, sample_anchors
from quarc_ref.decoder.compiled_motion import move_through
from quarc_ref.decoder.rotation import expand_rotations, normalize_sums, turn
from quarc_ref.decoder.scene import MOTION_KERNELS, Scene, append, remove, start_removing
from quarc_ref.decoder.state import State
from quarc_ref.decoder.stopwatch import stage
from quarc_ref.format.acceleration import load_kernels, map_parts, settled, start_parts
from quarc_ref.format.arrays import Int16, Int32, Int64
from quarc_ref.format.constants import CODE_LIMIT, COUNTER_LIMIT, POSITION_LIMIT, RECENCY_LIMIT
from quarc_ref.format.contexts import ContextCounts
from quarc_ref.format.errors import (
    CodeRangeError,
    CountError,
    CountLevelError,
    ParentRangeError,
    PositionRangeError,
)
from quarc_ref.format.motion_planes import LevelContext
from quarc_ref.format.records import OPACITY, Births, Gaussians, StreamHeader


def begin_canonical(header: StreamHeader, frame: int, gaussians: Gaussians) -> State:
    """Return the state of a canonical frame (SPEC 7.2).

    Raises:
        StateError: A position or a rotation is out of range.
    """
    count = gaussians.count
    scene = Scene(
        header,
        frame,
        0,
        np.arange(count, dtype=np.int64),
        _narrow_positions(gaussians.positions * header.position_step),
        expand_rotations(gaussians.rotations, header.rotation_bits),
        _narrow_codes(gaussians.codes),
    )
    motion = np.zeros((header.symbol_planes, count), dtype=np.int16)
    recency = np.full(count, RECENCY_LIMIT, dtype=np.int16) if header.updates else None
    nothing = ContextCounts()
    return State(scene, motion, (), None, None, count, nothing, nothing, nothing, recency)


def begin_frame(state: State, death_count: int, room: int = 0, *, meanwhile: bool = False) -> State:
    """Return the state with the dead gone and every Gaussian bound (SPEC 7.4).

    Args:
        state: Of the frame before.
        death_count: Gaussians that leave, those of least (opacity code, id).
        room: As in `State`, if it is known.
        meanwhile: Whether other threads may go on with what nothing before `move` reads,
            which waits for them.

    Raises:
        CountError: No Gaussian would be left.
    """
    if death_count >= state.scene.count:
        message = f"{death_count} deaths among {state.scene.count} Gaussians"
        raise CountError(message)
    with stage("deaths"):
        before, gone = state.scene, np.sort(choose_deaths(state.scene, death_count))
        motion, wait_for_motion = start_removing(state.motion, gone)
        recency = None if state.recency is None else remove(state.recency[None], gone)[0]
        kept, wait_for_planes = before.without(gone, room)
        scene = replace(kept, frame=before.frame + 1, phase=before.phase + 1)
        wait_for_motion()
    anchors = state.anchors
    if anchors is None or before.phase % scene.header.resample_interval == 0:
        with stage("sampling"):
            anchors = sample_anchors(scene)
    else:
        with stage("newborn"):
            anchors = _follow_on(anchors, gone, scene.positions)

    def wait() -> None:
        wait_for_planes()
        anchors.wait()

    if not meanwhile:
        wait()
    return replace(
        state,
        scene=scene,
        motion=motion,
        recency=recency,
        symbols=(),
        anchors=anchors,
        births=None,
        updates=None,
        room=room,
        wait=wait,
    )


def choose_deaths(scene: Scene, count: int) -> Int64:
    """Return the indices of the Gaussians of least (opacity code, id) (SPEC 7.4)."""
    kernels = load_kernels(MOTION_KERNELS, scene.count)
    if kernels is not None:
        least: Int64 = kernels.find_least(scene.codes[OPACITY.start], count)
        return least
    order = np.argsort(scene.codes[OPACITY.start], kind="stable")
    return order[:count]


def motion_contexts(state: State, *, previous: bool) -> list[LevelContext]:
    """Return what is known of every level's anchors before their symbols (SPEC 8.7).

    Args:
        state: After `begin_frame`.
        previous: Whether the last frame's motion counts.
    """

    def know(level: AnchorLevel) -> LevelContext:
        if previous:
            motion = _recall(state, level.owners)
        else:
            motion = np.zeros((state.motion.shape[0], level.owners.size), dtype=np.int16)
        return LevelContext(level.parents, motion)

    return map_parts(know, state.known_anchors.levels)


def move(state: State, symbols: list[Int64]) -> State:
    """Return the state with every Gaussian moved by its anchors (SPEC 7.5, Eq. 2).

    Args:
        state: After `begin_frame`.
        symbols: `[c, a]` of each level, level 1 first.

    Raises:
        PositionRangeError: A Gaussian leaves the lattice.
        DegenerateRotationError: A sum of residuals is zero.
    """
    scene, anchors, room = state.scene, state.known_anchors, state.room
    state.wait()
    kernels = load_kernels(MOTION_KERNELS, scene.count)
    if kernels is None:
        room = 0
        followed = zip(symbols, anchors.binding, strict=True)
        sums = np.sum([level[:, binding] for level, binding in followed], axis=0)
        positions = _narrow_positions(scene.positions + sums[:3] * scene.header.translation_step)
        rotations, motion = _turn_all(scene, sums[3:]), sums.astype(np.int16)
    else:
        positions, rotations, motion = move_through(kernels, scene, anchors, symbols, room)
    moved = replace(scene, positions=positions, rotations=rotations)
    done = tuple(symbols)
    return replace(state, scene=moved, motion=motion, symbols=done, room=room, wait=settled)


def bear(state: State, births: Births) -> State:
    """Return the state with the newborn of a frame appended (SPEC 7.6).

    Args:
        state: After `move` and, in a stream with updates, `updates.update`.
        births: The newborn, in steps.

    Raises:
        CountLevelError: More Gaussians than the level allows, or more ids than there are.
        StateError: A parent, a position, a code or a rotation is out of range.
    """
    scene, header, room = state.scene, state.scene.header, state.room
    parents, newborn = births.parents, births.newborn
    if newborn.count == 0:
        return replace(state, births=births)
    if scene.count + newborn.count > header.limits.gaussians:
        message = f"{scene.count + newborn.count} Gaussians are too many for the level"
        raise CountLevelError(message)
    if state.next_id + newborn.count > COUNTER_LIMIT + 1:
        message = "there are no ids left for the newborn"
        raise CountLevelError(message)
    if np.any(parents >= scene.count):
        message = "a newborn's parent is not in the scene"
        raise ParentRangeError(message)
    positions = scene.positions[:, parents] + newborn.positions * header.position_step
    rotations = expand_rotations(newborn.rotations, header.rotation_bits)
    codes = _narrow_codes(newborn.codes)
    ids = state.next_id + np.arange(newborn.count)
    grown = replace(
        scene,
        ids=append(scene.ids[None], ids[None], room)[0],
        positions=append(scene.positions, _narrow_positions(positions), room),
        rotations=append(scene.rotations, rotations, room),
        codes=append(scene.codes, codes, room),
    )
    still = np.zeros((state.motion.shape[0], newborn.count), dtype=np.int16)
    motion = append(state.motion, still, room)
    recency = state.recency
    if recency is not None:
        recency = np.append(recency, np.zeros(newborn.count, dtype=np.int16))
    return replace(
        state,
        scene=grown,
        motion=motion,
        recency=recency,
        births=births,
        next_id=state.next_id + newborn.count,
        room=0,
    )


def _recall(state: State, owners: Int64) -> Int16:
    """Return `[c, a]` the last motion of anchors' Gaussians, 0 of those that have died."""
    kernels = load_kernels(MOTION_KERNELS, state.scene.count)
    if kernels is not None:
        recalled: Int16 = kernels.recall(state.scene.ids, owners, state.motion)
        return recalled
    place = np.minimum(np.searchsorted(state.scene.ids, owners), state.scene.count - 1)
    alive = state.scene.ids[place] == owners
    remembered: Int16 = state.motion[:, place] * alive
    return remembered


def _follow_on(anchors: Anchors, gone: Int64, positions: Int32) -> Anchors:
    """Return the anchors of a frame that does not sample: only the newborn are bound."""
    lost = gone[gone < anchors.binding.shape[1]]
    left = anchors.binding.shape[1] - lost.size
    binding = np.empty((len(anchors.levels), positions.shape[1]), dtype=np.int32)

    def follow(level: int) -> None:
        binding[level, :left] = remove(anchors.binding[level][None], lost)[0]
        binding[level, left:] = bind_newborn(anchors.levels[level], positions[:, left:])

    return Anchors(anchors.levels, binding, start_parts(follow, range(len(anchors.levels))))


def _turn_all(scene: Scene, sums: Int64) -> Int32:
    """Return every rotation turned by its sum of residuals; a zero sum keeps it (SPEC 7.5)."""
    header = scene.header
    turning = np.flatnonzero(np.any(sums, axis=0))
    if header.rotation_components == _WITHOUT_W:
        sums = np.vstack([np.zeros_like(sums[:1]), sums])
    sums = sums[:, turning]
    sums[0] += header.rotation_unity * header.level_count
    rotations = scene.rotations.copy()
    rotations[:, turning] = turn(scene.rotations[:, turning], normalize_sums(sums))
    return rotations


def _narrow_positions(positions: Int64) -> Int32:
    if _exceed(positions, POSITION_LIMIT):
        message = "a Gaussian leaves the lattice"
        raise PositionRangeError(message)
    return positions.astype(np.int32)


def _narrow_codes(codes: Int64) -> Int16:
    if _exceed(codes, CODE_LIMIT):
        message = "an attribute code leaves its range"
        raise CodeRangeError(message)
    return codes.astype(np.int16)


def _exceed(numbers: Int64, limit: int) -> bool:
    return bool(numbers.max(initial=0) > limit or numbers.min(initial=0) < -limit)


_WITHOUT_W = 3
