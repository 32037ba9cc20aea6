"""A frame's chunk to the state of the frame: SPEC 7.

The counts are proved before anything is allocated by them, and the state by
its CRC before it is given out.
"""

from collections.abc import Callable
from dataclasses import replace

from quarc_ref.decoder.digest import compute_state_crc
from quarc_ref.decoder.reconstruct import bear, begin_canonical, begin_frame, motion_contexts, move
from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.state import State
from quarc_ref.decoder.stopwatch import stage
from quarc_ref.decoder.updates import update, update_context
from quarc_ref.format.acceleration import start_parts, threading_for
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import COUNTER_LIMIT, LEVELS
from quarc_ref.format.contexts import ContextCounts
from quarc_ref.format.errors import (
    CountError,
    CountLevelError,
    FrameOrderError,
    LimitError,
    StateCrcError,
)
from quarc_ref.format.gaussian_planes import read_births, read_canonical
from quarc_ref.format.motion_planes import read_motion
from quarc_ref.format.records import (
    Births,
    CanonicalChunk,
    FrameChunk,
    Gaussians,
    Section,
    SnapshotChunk,
    StreamHeader,
)
from quarc_ref.format.snapshot_planes import Snapshot, read_snapshot
from quarc_ref.format.update_planes import read_updates

# Holds a scene against the CRC that its chunk states, now or later.
Prove = Callable[[Scene, int], None]


def prove_state(scene: Scene, state_crc: int) -> None:
    """Hold a scene against the CRC of its chunk (SPEC 9.2).

    Raises:
        StateCrcError: It is not the one that was encoded.
    """
    with stage("crc"):
        crc = compute_state_crc(scene, all_fields=covers_all_fields(scene))
    if crc != state_crc:
        message = f"frame {scene.frame} is not the one that was encoded"
        raise StateCrcError(message)


def decode_canonical(
    header: StreamHeader, chunk: CanonicalChunk, prove: Prove | None = None
) -> State:
    """Return the state of a canonical frame (SPEC 7.2).

    Args:
        header: Of the stream.
        chunk: Of the frame.
        prove: What holds the state against the chunk's CRC; `prove_state` if None.

    Raises:
        BitstreamError: What is wrong with the chunk.
    """
    gaussians = read_checked(header, chunk)
    return make_canonical(header, chunk.frame, gaussians, chunk.state_crc, prove)


def read_checked(header: StreamHeader, chunk: CanonicalChunk) -> Gaussians:
    """Return the Gaussians of a canonical frame as they are coded; its counts are checked first.

    Raises:
        BitstreamError: What is wrong with the chunk.
    """
    count = chunk.gaussian_count
    if count == 0:
        message = "a canonical frame without Gaussians"
        raise CountError(message)
    _require_within_level(header, count)
    with stage("entropy"):
        return read_canonical(chunk, header.code_planes)


def decode_snapshot(
    header: StreamHeader,
    chunk: SnapshotChunk,
    canonical: Gaussians,
    prove: Prove | None = None,
) -> tuple[State, Int64]:
    """Return the state of a snapshot (SPEC 7.9).

    Args:
        header: Of the stream.
        chunk: Of the frame.
        canonical: Gaussians of the CANO that it is coded against, as they are coded.
        prove: As for `decode_canonical`.

    Returns:
        The state, and `[N]` the index in the CANO of each Gaussian that is a survivor; -1 of
        the others.

    Raises:
        BitstreamError: What is wrong with the chunk.
    """
    snapshot = read_checked_snapshot(header, chunk, canonical)
    state = make_canonical(header, chunk.frame, snapshot.gaussians, chunk.state_crc, prove)
    return state, snapshot.roots


def read_checked_snapshot(
    header: StreamHeader, chunk: SnapshotChunk, canonical: Gaussians
) -> Snapshot:
    """Return the Gaussians of a snapshot as they are coded; its counts are checked first.

    Raises:
        BitstreamError: What is wrong with the chunk.
    """
    _require_within_level(header, chunk.newborn_count)
    with stage("entropy"):
        snapshot = read_snapshot(chunk, canonical)
    count = snapshot.gaussians.count
    if count == 0:
        message = "a snapshot without Gaussians"
        raise CountError(message)
    _require_within_level(header, count)
    return snapshot


def make_canonical(
    header: StreamHeader, frame: int, gaussians: Gaussians, crc: int, prove: Prove | None
) -> State:
    """Return the state that coded Gaussians make, held against the CRC that a chunk states.

    Raises:
        StateError: What is wrong with it.
    """
    with stage("canonical"):
        state = begin_canonical(header, frame, gaussians)
    (prove or prove_state)(state.scene, crc)
    return state


def decode_frame(state: State, chunk: FrameChunk, prove: Prove | None = None) -> State:
    """Return the state of the frame after `state` (SPEC 7.4 to 7.7).

    Args:
        state: Of the frame before.
        chunk: Of the frame.
        prove: What holds the state against the chunk's CRC; `prove_state` if None.

    Raises:
        BitstreamError: What is wrong with the chunk.
    """
    if chunk.phase != state.scene.phase + 1:
        message = f"phase {chunk.phase} follows {state.scene.phase}"
        raise FrameOrderError(message)
    if state.scene.frame == COUNTER_LIMIT:
        message = f"no frame can follow frame {COUNTER_LIMIT}"
        raise FrameOrderError(message)
    # Room for the newborn that are told of, if they are not too many: they are refused below.
    limits = (state.scene.header.limits.births, _OWN_LIMITS.births)
    room = min(chunk.birth_count, *limits)
    with threading_for(state.scene.count):
        bear_decoded = _start_births(state, chunk.births, chunk.birth_count)
        begun = begin_frame(state, chunk.death_count, room, meanwhile=True)
        moved = decode_motion(begun, chunk.motion, previous=chunk.previous_contexts)
        updated = moved
        if chunk.updates is not None:
            updated = decode_updates(moved, chunk.updates, state.scene)
        grown = bear_decoded(updated)
    (prove or prove_state)(grown.scene, chunk.state_crc)
    return grown


def decode_motion(state: State, section: Section, *, previous: bool) -> State:
    """Return the state moved by a section (SPEC 7.5).

    Args:
        state: After `begin_frame`.
        section: The frame's motion.
        previous: Whether the last frame's motion gives contexts.

    Raises:
        BitstreamError: What is wrong with the section.
    """
    with stage("entropy"):
        contexts = motion_contexts(state, previous=previous)
        symbols, counts = read_motion(section, contexts, state.motion_counts)
    with stage("binding"):  # what `move` would wait for, told apart from the motion
        state.wait()
    with stage("motion"):
        return move(replace(state, motion_counts=counts), symbols)


def decode_updates(state: State, section: Section, before: Scene | None = None) -> State:
    """Return the state with the updates of a section (SPEC 7.8).

    Args:
        state: After `decode_motion`, of a stream with updates.
        section: The frame's updates.
        before: As for `updates.update`.

    Raises:
        BitstreamError: What is wrong with the section.
    """
    with stage("entropy"):
        updates, counts = read_updates(section, update_context(state), state.update_counts)
    with stage("updates"):
        return update(replace(state, update_counts=counts), updates, before)


def decode_births(state: State, section: Section, count: int) -> State:
    """Return the state with the newborn of a section (SPEC 7.6).

    Args:
        state: After `decode_motion` and, in a stream with updates, `decode_updates`.
        section: The frame's births.
        count: How many.

    Raises:
        BitstreamError: What is wrong with the section.
    """
    return _start_births(state, section, count)(state)


def _start_births(state: State, section: Section, count: int) -> Callable[[State], State]:
    """Begin to read the newborn of a frame, which other threads may do.

    Args:
        state: Of the frame before, or of the frame.
        section: The frame's births.
        count: How many; too many are not read.

    Returns:
        What does as `decode_births`; it refuses now what was wrong.
    """
    header = state.scene.header

    def read(part: Section) -> tuple[Births, ContextCounts]:
        with stage("births"):
            return read_births(part, header.code_planes, count, state.birth_counts)

    most = min(header.limits.births, _OWN_LIMITS.births)
    wait = start_parts(read, [section] if count <= most else [])

    def bear_decoded(moved: State) -> State:
        if count > header.limits.births:
            message = f"{count} births are too many for level {header.level}"
            raise CountLevelError(message)
        _decline_beyond(_OWN_LIMITS.births, count, "births")
        _decline_beyond(_OWN_LIMITS.gaussians, moved.scene.count + count, "Gaussians")
        ((births, counts),) = wait()
        with stage("births"):
            return bear(replace(moved, birth_counts=counts), births)

    return bear_decoded


def covers_all_fields(scene: Scene) -> bool:
    """Tell whether a frame's CRC covers the codes too (SPEC 9.2)."""
    return scene.phase % scene.header.full_crc_interval == 0


def _require_within_level(header: StreamHeader, count: int) -> None:
    """Refuse a canonical frame of too many Gaussians (SPEC 3.2)."""
    if count > header.limits.gaussians:
        message = f"{count} Gaussians are too many for level {header.level}"
        raise CountLevelError(message)
    _decline_beyond(_OWN_LIMITS.gaussians, count, "Gaussians")


def _decline_beyond(most: int, count: int, what: str) -> None:
    """Keep to this decoder's own limits, which matter at the unlimited level alone.

    Raises:
        LimitError: It is beyond them, which is no fault of the stream.
    """
    if count > most:
        message = f"{count:,} {what} are more than this decoder takes, {most:,}"
        raise LimitError(message)


_OWN_LIMITS = LEVELS[30]  # what stands at the unlimited level (SPEC 3.2)
