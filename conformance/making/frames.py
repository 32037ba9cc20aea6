"""Makes the payloads of CANO, SNAP and FRAM chunks, and their states, from hand-written records.

The state is computed by `plain.decoder`, which follows SPEC.md in plain integers and shares no code
with quarc_ref.
"""

import zlib
from collections.abc import Sequence
from typing import Any

from making.changes import Change, CodedGaussian, Survivor, choose_no_code
from making.payloads import Canonical, Frame, Head, Snapshot
from making.planes import (
    compute_morton_key,
    make_birth_planes,
    make_canonical_planes,
    make_motion_planes,
    make_survivor_planes,
    make_update_planes,
)
from making.writing import CodeChoice, Planes, WritingSection
from plain.coder import Counts
from plain.decoder import FrameDecoder
from plain.planes import PlainSection
from plain.state import PlainState, Vector


class _FrameEncoder(FrameDecoder):
    """Computes the state of a frame from its fields, and encodes each section while reading it."""

    def __init__(self, head: Head, fields: dict[str, Any]) -> None:
        super().__init__({name: getattr(head, name) for name in head.__slots__}, fields)
        self.sections: list[WritingSection] = []
        self.anchor_counts: list[int] = []
        self.is_valid = True

    def _open_section(self, title: str, stored: Any, counts: Counts) -> PlainSection:
        if isinstance(stored, dict):
            return super()._open_section(title, stored, counts)
        if callable(stored):
            stored = stored(self.anchor_counts)
        section = WritingSection(title, stored, counts)
        self.sections.append(section)
        return section

    def _expand_rotation(self, coded: Vector, bits: int) -> Vector:
        try:
            return super()._expand_rotation(coded, bits)
        except ValueError:  # not a valid rotation; the other sections must be written anyway
            self.is_valid = False
            return [1 << 22, 0, 0, 0]

    def _apply_motion(self, state: PlainState) -> None:
        self.anchor_counts = [len(level.owners) for level in state.levels]
        super()._apply_motion(state)


def make_canonical(
    head: Head,
    frame: int,
    gaussians: Sequence[CodedGaussian],
    choose_code: CodeChoice = choose_no_code,
    **overrides: Any,
) -> tuple[Canonical, PlainState | None]:
    """Return the payload of a canonical frame, and the state after it.

    Args:
        head: HEAD of the stream.
        frame: Ordinal of the frame.
        gaussians: Gaussians in any order; they are written in Morton order.
        choose_code: Function that chooses the probability code to write for a context, if any.
        overrides: Field values that replace the computed ones; if they violate a clause, the
            returned state is None.
    """
    origin = overrides.get(
        "origin", tuple(min(gaussian.position[axis] for gaussian in gaussians) for axis in range(3))
    )
    sorted_gaussians = sorted(
        gaussians, key=lambda gaussian: compute_morton_key(gaussian.position, origin)
    )
    keys = [compute_morton_key(gaussian.position, origin) for gaussian in sorted_gaussians]
    extent = max(
        max(
            coordinate - origin_coordinate
            for coordinate, origin_coordinate in zip(gaussian.position, origin, strict=True)
        )
        for gaussian in gaussians
    )
    planes = make_canonical_planes(head, keys, sorted_gaussians)
    fields = {"frame": frame, "gaussian_count": len(keys), "origin": origin}
    fields |= {"axis_bits": max(0, extent).bit_length()} | overrides
    fields["sections"] = [Planes(bits, choose_code) for bits in planes]
    frame_encoder = _FrameEncoder(head, fields)
    state = _try_to_reconstruct(frame_encoder, None)
    fields["sections"] = tuple(section.written_words for section in frame_encoder.sections)
    return Canonical(state_crc=_compute_crc(head, state), **fields), state


def make_frame(
    head: Head, previous: PlainState, change: Change, **overrides: Any
) -> tuple[Frame, PlainState | None]:
    """Return the payload of the next frame, and the state after it; see `make_canonical`."""
    fields = {
        "phase": previous.phase + 1,
        "previous_contexts": change.previous_contexts,
        "death_count": change.death_count,
        "birth_count": len(change.births),
    } | overrides

    def make_motion(anchor_counts: list[int]) -> Planes:
        return Planes(make_motion_planes(head, anchor_counts, change), change.choose_code)

    motion: Any = {"words": change.motion_words}
    if change.motion_words is None:
        motion = make_motion
    births: Any = {"words": change.birth_words}
    if change.birth_words is None:
        births = Planes(make_birth_planes(head, change.births), change.choose_code)
    updates: Any = {"words": change.update_words}
    if change.update_words is None:
        gaussian_count = len(previous.gaussians) - change.death_count
        updates = Planes(make_update_planes(gaussian_count, change.updates), change.choose_code)
    frame_encoder = _FrameEncoder(
        head, {**fields, "motion": motion, "updates": updates, "births": births}
    )
    state = _try_to_reconstruct(frame_encoder, previous)
    words_by_section = {section.title: section.written_words for section in frame_encoder.sections}
    motion_words = words_by_section.get("motion", change.motion_words or ())
    birth_words = words_by_section.get("births", change.birth_words or ())
    update_words = (
        words_by_section.get("updates", change.update_words or ()) if head.has_updates else None
    )
    frame = Frame(
        motion=motion_words,
        updates=update_words,
        births=birth_words,
        state_crc=_compute_crc(head, state),
        **fields,
    )
    return frame, state


def make_snapshot(
    head: Head,
    previous: PlainState,
    survivors: Sequence[Survivor],
    newborn: Sequence[CodedGaussian] = (),
    choose_code: CodeChoice = choose_no_code,
    **overrides: Any,
) -> tuple[Snapshot, PlainState | None]:
    """Return the payload of a snapshot, and the state after it; see `make_canonical`.

    Args:
        head: HEAD of the stream.
        previous: State of the previous frame.
        survivors: Survivors in ascending order of their indices.
        newborn: New Gaussians in any order; they are written in Morton order.
        choose_code: Function that chooses the probability code to write for a context, if any.
        overrides: Field values that replace the computed ones; `survivors` replaces the words of
            the survivors section.
    """
    canonical_frame, canonical_gaussians = previous.canonical or (0, [])
    positions = [g.position for g in newborn] or [(0, 0, 0)]
    origin = overrides.get("origin", tuple(min(p[axis] for p in positions) for axis in range(3)))
    sorted_newborn = sorted(newborn, key=lambda g: compute_morton_key(g.position, origin))
    keys = [compute_morton_key(g.position, origin) for g in sorted_newborn]
    extent = max(max(v - o for v, o in zip(p, origin, strict=True)) for p in positions)
    survivor_words = overrides.pop("survivors", None)
    fields = {"frame": previous.frame + 1, "canonical": canonical_frame, "newborn_count": len(keys)}
    fields |= {"origin": origin, "axis_bits": max(0, extent).bit_length()} | overrides
    planes = Planes(make_survivor_planes(len(canonical_gaussians), survivors), choose_code)
    stored_survivors: dict[str, Any] = {
        "survivors": planes if survivor_words is None else {"words": survivor_words}
    }
    sections = [
        Planes(bits, choose_code) for bits in make_canonical_planes(head, keys, sorted_newborn)
    ]
    frame_encoder = _FrameEncoder(head, fields | stored_survivors | {"sections": sections})
    state = _try_to_reconstruct(frame_encoder, previous)
    written_words = [section.written_words for section in frame_encoder.sections]
    if survivor_words is not None:
        written_words.insert(0, survivor_words)
    written_words += [()] * (7 - len(written_words))
    return Snapshot(
        survivors=written_words[0],
        sections=tuple(written_words[1:]),
        state_crc=_compute_crc(head, state),
        **fields,
    ), state


def _try_to_reconstruct(
    frame_encoder: _FrameEncoder, previous: PlainState | None
) -> PlainState | None:
    """Return the state after a frame; None if the fields of the frame violate a clause."""
    try:
        state = frame_encoder.reconstruct_state(previous)
    except (AssertionError, ValueError, IndexError, ZeroDivisionError):
        return None
    return state if frame_encoder.is_valid else None


def _compute_crc(head: Head, state: PlainState | None) -> int:
    if state is None:
        return 0
    return zlib.crc32(state.serialize(codes=state.phase % head.full_crc_interval == 0))
