"""Frames of hand-written records: the content of a CANO or FRAM chunk, and its state.

The state is computed by `plain.decoder`, which follows SPEC in plain integers and shares no code
with the package.
"""

import zlib
from collections.abc import Sequence
from typing import Any

from making.changes import Change, Coded, Survivor, state_nothing
from making.payloads import Canonical, Frame, Head, Snapshot
from making.planes import (
    birth_planes,
    canonical_planes,
    morton,
    motion_planes,
    survivor_planes,
    update_planes,
)
from making.writing import Planes, State, WritingSection
from plain.coder import Counts
from plain.decoder import FrameDecoder
from plain.planes import PlainSection
from plain.state import PlainState, Vector


class _Maker(FrameDecoder):
    """A frame with fields, whose sections are written while they are walked."""

    def __init__(self, head: Head, fields: dict[str, Any]) -> None:
        super().__init__({name: getattr(head, name) for name in head.__slots__}, fields)
        self.sections: list[WritingSection] = []
        self.levels: list[int] = []
        self.has_state = True

    def _open_section(self, title: str, stored: Any, counts: Counts) -> PlainSection:
        if isinstance(stored, dict):
            return super()._open_section(title, stored, counts)
        if callable(stored):
            stored = stored(self.levels)
        section = WritingSection(title, stored, counts)
        self.sections.append(section)
        return section

    def _expand_rotation(self, coded: Vector, bits: int) -> Vector:
        try:
            return super()._expand_rotation(coded, bits)
        except ValueError:  # it is not a rotation; what follows must be written anyway
            self.has_state = False
            return [1 << 22, 0, 0, 0]

    def _apply_motion(self, state: PlainState) -> None:
        self.levels = [len(level.owners) for level in state.levels]
        super()._apply_motion(state)


def make_canonical(
    head: Head, frame: int, gaussians: Sequence[Coded], stating: State = state_nothing, **said: Any
) -> tuple[Canonical, PlainState | None]:
    """Return a canonical frame.

    Args:
        head: Of the stream.
        frame: Its ordinal.
        gaussians: Gaussians, which are sorted in Morton order.
        stating: Which probability codes the planes state.
        said: Fields with other values; the state is None if they violate a clause.
    """
    origin = said.get("origin", tuple(min(g.position[a] for g in gaussians) for a in range(3)))
    ordered = sorted(gaussians, key=lambda g: morton(g.position, origin))
    keys = [morton(g.position, origin) for g in ordered]
    most = max(max(p - o for p, o in zip(g.position, origin, strict=True)) for g in gaussians)
    planes = canonical_planes(head, keys, ordered)
    fields = {"frame": frame, "gaussian_count": len(keys), "origin": origin}
    fields |= {"axis_bits": max(0, most).bit_length()} | said
    fields["sections"] = [Planes(bits, stating) for bits in planes]
    maker = _Maker(head, fields)
    state = _try(maker, None)
    fields["sections"] = tuple(section.written for section in maker.sections)
    return Canonical(state_crc=_crc(head, state), **fields), state


def make_frame(
    head: Head, before: PlainState, change: Change, **said: Any
) -> tuple[Frame, PlainState | None]:
    """Return the frame after a state; see `make_canonical`."""
    fields = {
        "phase": before.phase + 1,
        "previous_contexts": change.previous,
        "death_count": change.deaths,
        "birth_count": len(change.births),
    } | said
    motion: Any = {"words": change.motion}
    if change.motion is None:
        motion = lambda counts: Planes(motion_planes(head, counts, change), change.stating)  # noqa: E731
    births: Any = {"words": change.newborn}
    if change.newborn is None:
        births = Planes(birth_planes(head, change.births), change.stating)
    updates: Any = {"words": change.updated}
    if change.updated is None:
        count = len(before.gaussians) - change.deaths
        updates = Planes(update_planes(count, change.updates), change.stating)
    maker = _Maker(head, {**fields, "motion": motion, "updates": updates, "births": births})
    state = _try(maker, before)
    words = {section.title: section.written for section in maker.sections}
    moved = words.get("motion", change.motion or ())
    born = words.get("births", change.newborn or ())
    changed = words.get("updates", change.updated or ()) if head.has_updates else None
    frame = Frame(motion=moved, updates=changed, births=born, state_crc=_crc(head, state), **fields)
    return frame, state


def make_snapshot(
    head: Head,
    before: PlainState,
    survivors: Sequence[Survivor],
    newborn: Sequence[Coded] = (),
    stating: State = state_nothing,
    **said: Any,
) -> tuple[Snapshot, PlainState | None]:
    """Return a snapshot after a state; see `make_canonical`.

    Args:
        head: Of the stream.
        before: State of the previous frame.
        survivors: Survivors in ascending order of their indices.
        newborn: New Gaussians, which are sorted in Morton order.
        stating: Which probability codes the planes state.
        said: Fields with other values; `survivors` for its words.
    """
    frame, known = before.canonical or (0, [])
    places = [g.position for g in newborn] or [(0, 0, 0)]
    origin = said.get("origin", tuple(min(p[axis] for p in places) for axis in range(3)))
    ordered = sorted(newborn, key=lambda g: morton(g.position, origin))
    keys = [morton(g.position, origin) for g in ordered]
    most = max(max(v - o for v, o in zip(p, origin, strict=True)) for p in places)
    words = said.pop("survivors", None)
    fields = {"frame": before.frame + 1, "canonical": frame, "newborn_count": len(keys)}
    fields |= {"origin": origin, "axis_bits": max(0, most).bit_length()} | said
    planes = Planes(survivor_planes(len(known), survivors), stating)
    stored: dict[str, Any] = {"survivors": planes if words is None else {"words": words}}
    sections = [Planes(bits, stating) for bits in canonical_planes(head, keys, ordered)]
    maker = _Maker(head, fields | stored | {"sections": sections})
    state = _try(maker, before)
    written = [section.written for section in maker.sections]
    if words is not None:
        written.insert(0, words)
    written += [()] * (7 - len(written))
    return Snapshot(
        survivors=written[0], sections=tuple(written[1:]), state_crc=_crc(head, state), **fields
    ), state


def _try(maker: _Maker, before: PlainState | None) -> PlainState | None:
    """Return the state; None if the given fields do not lead to one."""
    try:
        state = maker.reconstruct_state(before)
    except (AssertionError, ValueError, IndexError, ZeroDivisionError):
        return None
    return state if maker.has_state else None


def _crc(head: Head, state: PlainState | None) -> int:
    if state is None:
        return 0
    return zlib.crc32(state.serialize(codes=state.phase % head.full_crc_interval == 0))
