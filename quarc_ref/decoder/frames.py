"""Decodes a frame's chunk to the frame's state, in the order of SPEC 7.

Counts are checked before memory is allocated for them, and the state is
checked against its CRC before it is returned.
"""

from dataclasses import replace

from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.digest import state_crc
from quarc_ref.decoder.limits import check_birth_count, check_gaussian_count
from quarc_ref.decoder.reconstruct import append_births, begin_frame, motion_contexts, move
from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.state import State
from quarc_ref.decoder.updates import apply_updates, update_context
from quarc_ref.format.arrays import Int64
from quarc_ref.format.coding.gaussian_planes import read_births, read_canonical
from quarc_ref.format.coding.motion_planes import read_motion
from quarc_ref.format.coding.snapshot_planes import Snapshot, read_snapshot
from quarc_ref.format.coding.update_planes import read_updates
from quarc_ref.format.constants import COUNTER_LIMIT
from quarc_ref.format.errors import (
    CountError,
    FrameOrderError,
    StateCrcError,
)
from quarc_ref.format.records import (
    CanonicalChunk,
    FrameChunk,
    Gaussians,
    Section,
    SnapshotChunk,
    StreamHeader,
)


def decode_canonical(header: StreamHeader, chunk: CanonicalChunk) -> tuple[State, Gaussians]:
    """Return the state of a canonical frame and its coded Gaussians (SPEC 7.2).

    Raises:
        BitstreamError: The chunk is invalid.
    """
    gaussians = read_checked_canonical(header, chunk)
    state = begin_canonical(header, chunk.frame, gaussians)
    check_state(state.scene, chunk.state_crc)
    return state, gaussians


def read_checked_canonical(header: StreamHeader, chunk: CanonicalChunk) -> Gaussians:
    """Return the coded Gaussians of a canonical frame, after checking their number.

    Raises:
        BitstreamError: The chunk is invalid.
    """
    if chunk.gaussian_count == 0:  # [7.2-2]
        message = "a canonical frame has no Gaussians"
        raise CountError(message)
    check_gaussian_count(header, chunk.gaussian_count)
    return read_canonical(chunk, header.code_planes)


def decode_snapshot(
    header: StreamHeader, chunk: SnapshotChunk, canonical: Gaussians
) -> tuple[State, Int64]:
    """Return the state of a snapshot (SPEC 7.9).

    Args:
        header: Header of the stream.
        chunk: Chunk of the frame.
        canonical: Coded Gaussians of the canonical frame that the snapshot refers to.

    Returns:
        The state, and the `[N]` index of each Gaussian in the canonical frame, -1 for new
        Gaussians.

    Raises:
        BitstreamError: The chunk is invalid.
    """
    snapshot = read_checked_snapshot(header, chunk, canonical)
    state = begin_canonical(header, chunk.frame, snapshot.gaussians)  # [7.9-5]
    check_state(state.scene, chunk.state_crc)
    return state, snapshot.canonical_indices


def read_checked_snapshot(
    header: StreamHeader, chunk: SnapshotChunk, canonical: Gaussians
) -> Snapshot:
    """Return the coded Gaussians of a snapshot, after checking their number.

    Raises:
        BitstreamError: The chunk is invalid.
    """

    def check_count(count: int) -> None:
        if count == 0:  # [7.9-3]
            message = "a snapshot has no Gaussians"
            raise CountError(message)
        check_gaussian_count(header, count)

    check_gaussian_count(header, chunk.newborn_count)
    return read_snapshot(chunk, canonical, check_count)


def decode_frame(state: State, chunk: FrameChunk) -> State:
    """Return the state of the frame after `state` (SPEC 7.4 to 7.8).

    Args:
        state: State of the previous frame.
        chunk: Chunk of the frame.

    Raises:
        BitstreamError: The chunk is invalid.
    """
    if chunk.phase != state.scene.phase + 1:  # [7.4-1]
        phase = state.scene.phase
        message = f"phase {chunk.phase} follows phase {phase}; expected phase {phase + 1}"
        raise FrameOrderError(message)
    if state.scene.frame == COUNTER_LIMIT:  # [7.4-2]
        message = f"no frame can follow frame {COUNTER_LIMIT}"
        raise FrameOrderError(message)
    state = begin_frame(state, chunk.death_count)
    state = decode_motion(state, chunk.motion, use_previous=chunk.previous_contexts)
    if chunk.updates is not None:
        state = decode_updates(state, chunk.updates)
    state = decode_births(state, chunk.births, chunk.birth_count)
    check_state(state.scene, chunk.state_crc)
    return state


def decode_motion(state: State, section: Section, *, use_previous: bool) -> State:
    """Decode the motion of a frame, and return the state after it (SPEC 7.5).

    Args:
        state: State after `begin_frame`.
        section: Coded motion of the frame.
        use_previous: Whether the contexts depend on the motion of the previous frame.

    Raises:
        BitstreamError: The section is invalid.
    """
    contexts = motion_contexts(state, use_previous=use_previous)
    symbols, counts = read_motion(section, contexts, state.motion_counts)
    return move(replace(state, motion_counts=counts), symbols)


def decode_updates(state: State, section: Section) -> State:
    """Decode the updates of a frame, and return the state after them (SPEC 7.8).

    Args:
        state: State after `decode_motion`; the stream must have updates.
        section: Coded updates of the frame.

    Raises:
        BitstreamError: The section is invalid.
    """
    updates, counts = read_updates(section, update_context(state), state.update_counts)
    return apply_updates(replace(state, update_counts=counts), updates)


def decode_births(state: State, section: Section, count: int) -> State:
    """Decode the births of a frame, and return the state after them (SPEC 7.6).

    Args:
        state: State after `decode_motion` and, in a stream with updates, `decode_updates`.
        section: Coded births of the frame.
        count: Number of births.

    Raises:
        BitstreamError: The section is invalid.
    """
    header = state.scene.header
    check_birth_count(header, count, state.scene.count)
    births, counts = read_births(section, header.code_planes, count, state.birth_counts)
    return append_births(replace(state, birth_counts=counts), births)


def check_state(scene: Scene, stored_crc: int) -> None:
    """Compare the CRC of a scene with the CRC that its chunk contains (SPEC 9.2).

    Raises:
        StateCrcError: The scene differs from the encoder's scene.
    """
    if state_crc(scene) != stored_crc:  # [9.2-1] [9.2-2]
        message = f"the state of frame {scene.frame} differs from the encoder's"
        raise StateCrcError(message)
