"""Frames from records made by hand: what a CANO or a FRAM chunk holds, and its state.

The state is that of `tests.spec.plain_decoder`, which follows the text in
plain integers and shares no line with the package.
"""

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from making import writing
from making.payloads import Canonical, Frame, Head, Snapshot
from making.writing import Bits, Planes, State, WritingSection
from tests.spec.plain_coder import Counts
from tests.spec.plain_decoder import FrameDecoder
from tests.spec.plain_planes import PlainSection
from tests.spec.plain_state import PlainState, Vector

Symbols = Callable[[int, int], Sequence[int] | None]
"""Of a level and an anchor: its symbols; None for one that does not move."""


def _stay(_level: int, _anchor: int) -> None:
    return None


def say_nothing(_model: str, _context: int, _zeros: int, _ones: int) -> None:
    """State no probability."""
    return


@dataclass(frozen=True)
class Coded:
    """A Gaussian as it is coded.

    Attributes:
        position: In position steps; of a newborn, less the parent's.
        rotation: j, a, b, c of SPEC 7.2.
        codes: Log-scales 3, opacity, SH DC 3, maybe SH rest 9.
        parent: Of a newborn, the index of its parent.
    """

    position: tuple[int, int, int]
    rotation: tuple[int, int, int, int] = (0, 0, 0, 0)
    codes: tuple[int, ...] = (-40, -40, -40, 10, 0, 0, 0)
    parent: int = 0


@dataclass(frozen=True)
class Update:
    """What a frame does to one Gaussian (SPEC 7.8).

    Attributes:
        gaussian: Its index in the scene after the motion.
        residuals: The 13; None of one that leaves.
        fields: The fields that are answered yes, a bit to each; None for those with a residual
            that is not 0.
    """

    gaussian: int
    residuals: tuple[int, ...] | None = (0,) * 13
    fields: int | None = None


@dataclass(frozen=True)
class Survivor:
    """A Gaussian of the last CANO that a snapshot still has (SPEC 7.9).

    Attributes:
        index: In the CANO.
        differences: The 14.
        fields: As of `Update`.
    """

    index: int
    differences: tuple[int, ...] = (0,) * 14
    fields: int | None = None


@dataclass(frozen=True)
class Change:
    """What a FRAM chunk does.

    Attributes:
        symbols: Of the anchors.
        births: The newborn, in ascending order of their parents.
        deaths: How many leave.
        previous: Whether the last frame's motion gives contexts.
        stating: Which codes the planes state.
        motion: Words in place of those of the symbols.
        newborn: Words in place of those of the births.
        updates: Of single Gaussians, in ascending order of their indices.
        updated: Words in place of those of the updates.
    """

    symbols: Symbols = _stay
    births: tuple[Coded, ...] = ()
    deaths: int = 0
    previous: int = 1
    stating: State = say_nothing
    motion: tuple[int, ...] | None = None
    newborn: tuple[int, ...] | None = None
    updates: tuple[Update, ...] = ()
    updated: tuple[int, ...] | None = None


class _Maker(FrameDecoder):
    """A frame of fields whose sections are planes that are written as they are walked."""

    def __init__(self, head: Head, fields: dict[str, Any]) -> None:
        super().__init__({name: getattr(head, name) for name in head.__slots__}, fields)
        self.sections: list[WritingSection] = []
        self.levels: list[int] = []
        self.has_state = True

    def _open(self, title: str, stored: Any, counts: Counts) -> PlainSection:
        if isinstance(stored, dict):
            return super()._open(title, stored, counts)
        if callable(stored):
            stored = stored(self.levels)
        section = WritingSection(title, stored, counts)
        self.sections.append(section)
        return section

    def _expand(self, coded: Vector, bits: int) -> Vector:
        try:
            return super()._expand(coded, bits)
        except ValueError:  # it is no rotation; what follows is to be written all the same
            self.has_state = False
            return [1 << 22, 0, 0, 0]

    def _move(self, state: PlainState) -> None:
        self.levels = [len(level.owners) for level in state.levels]
        super()._move(state)


def make_canonical(
    head: Head, frame: int, gaussians: Sequence[Coded], stating: State = say_nothing, **said: Any
) -> tuple[Canonical, PlainState | None]:
    """Return a canonical frame.

    Args:
        head: Of the stream.
        frame: Its ordinal.
        gaussians: Are put in Morton order.
        stating: Which codes the planes state.
        said: Fields that are to say something else; the state is None if they break a clause.
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
    stating: State = say_nothing,
    **said: Any,
) -> tuple[Snapshot, PlainState | None]:
    """Return a snapshot after a state; see `make_canonical`.

    Args:
        head: Of the stream.
        before: The state of the frame before.
        survivors: In ascending order of their indices.
        newborn: Are put in Morton order.
        stating: Which codes the planes state.
        said: Fields that are to say something else, `survivors` its words.
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


def survivor_planes(count: int, survivors: Sequence[Survivor]) -> list[Bits]:
    """Return the planes of the survivors of a CANO of so many Gaussians (SPEC 8.9)."""
    kept = {survivor.index for survivor in survivors}
    answers = [_answers_of(s.differences, s.fields, _SURVIVOR_FIELDS) for s in survivors]
    planes = [
        [int(i in kept) for i in range(count)],
        *([answer >> number & 1 for answer in answers] for number in range(5)),
    ]
    for number, rows in enumerate(_SURVIVOR_FIELDS):
        there = [s for s, a in zip(survivors, answers, strict=True) if a >> number & 1]
        for row in rows:
            values = [s.differences[row] for s in there]
            if number == 0:
                values = [v - last for v, last in zip(values, [0, *values], strict=False)]
            planes += writing.fixed(values, 2) if row == 3 else writing.signed(values)
    return planes


_SURVIVOR_FIELDS = (range(3), range(3, 7), range(7, 10), range(10, 11), range(11, 14))


def morton(position: Sequence[int], origin: Sequence[int]) -> int:
    """Return the key of a position (SPEC 8.5)."""
    offsets = [p - o for p, o in zip(position, origin, strict=True)]
    if not any(offsets):
        return 0
    return sum((v >> b & 1) << (3 * b + 2 - a) for a, v in enumerate(offsets) for b in range(22))


def canonical_planes(head: Head, keys: list[int], gaussians: Sequence[Coded]) -> list[list[Bits]]:
    """Return the planes of the six sections (SPEC 8.5)."""
    codes = _code_rows(head, gaussians)
    turned = list(zip(*(g.rotation for g in gaussians), strict=True)) or [()] * 4
    rest = [bits for row in codes[7:] for bits in writing.signed(row)] if head.sh_degree else []
    return [
        writing.ascending(keys),
        writing.rows(*_colors(codes)),
        writing.rows(codes[3]),
        writing.rows(*codes[:3]),
        writing.fixed(turned[0], 2) + writing.rows(*turned[1:]),
        rest,
    ]


def birth_planes(head: Head, births: Sequence[Coded]) -> list[Bits]:
    """Return the planes of the newborn (SPEC 8.6)."""
    codes = _code_rows(head, births)
    turned = list(zip(*(g.rotation for g in births), strict=True)) or [()] * 4
    x, y, z = codes[:3]
    steps = (x, _less(y, x), _less(z, y))
    planes = [
        *writing.ascending([g.parent for g in births]),
        *writing.rows(*zip(*(g.position for g in births), strict=True)),
        *writing.rows(*_colors(codes)),
        *writing.rows(codes[3]),
        *writing.rows(*steps),
        *writing.fixed(turned[0], 2),
        *writing.rows(*turned[1:]),
    ]
    return planes + (writing.rows(*codes[7:]) if head.sh_degree else [])


def motion_planes(head: Head, counts: list[int], change: Change) -> list[Bits]:
    """Return the planes of the motion of so many anchors of each level (SPEC 8.7)."""
    channels = 3 + head.rotation_components
    planes = []
    for level in range(len(counts), 0, -1):
        given = [change.symbols(level, anchor) for anchor in range(counts[level - 1])]
        moving = [symbols for symbols in given if symbols is not None]
        there = [s[channel] for channel in range(channels) for s in moving if s[channel]]
        planes.append([int(symbols is not None) for symbols in given])
        planes += [[int(s[channel] != 0) for s in moving] for channel in range(channels)]
        planes.append([int(symbol < 0) for symbol in there])
        sizes = [abs(symbol) for symbol in there]
        planes += [[int(v > i + 1) for v in sizes if v > i] for i in range(64)]
    return planes


def update_planes(count: int, updates: Sequence[Update]) -> list[Bits]:
    """Return the planes of updates of a scene of so many Gaussians (SPEC 8.8)."""
    chosen = {update.gaussian for update in updates}
    left = [update for update in updates if update.residuals is not None]
    answers = [_answers_of(update.residuals, update.fields, _FIELDS) for update in left]
    planes = [
        [int(i in chosen) for i in range(count)],
        [int(update.residuals is None) for update in updates],
        *([answer >> number & 1 for answer in answers] for number in range(len(_FIELDS))),
    ]
    for number, rows in enumerate(_FIELDS):
        there = [u for u, answer in zip(left, answers, strict=True) if answer >> number & 1]
        for row in rows:
            planes += writing.signed([u.residuals[row] for u in there if u.residuals is not None])
    return planes


_FIELDS = (range(3), range(3, 6), range(6, 9), range(9, 10), range(10, 13))


def _answers_of(numbers: Sequence[int] | None, fields: int | None, rows: Sequence[range]) -> int:
    """Return which fields are answered yes, a bit to each: as is said, or those that are not 0."""
    if fields is not None or numbers is None:
        return fields or 0
    there = (any(numbers[row] for row in field) for field in rows)
    return sum(bit << number for number, bit in enumerate(there))


def _code_rows(head: Head, gaussians: Sequence[Coded]) -> list[tuple[int, ...]]:
    """Return the rows of codes; SH rest that a Gaussian does not name is 0."""
    width = 16 if head.sh_degree else 7
    return (
        list(zip(*((g.codes + (0,) * 9)[:width] for g in gaussians), strict=True)) or [()] * width
    )


def _colors(codes: Sequence[Sequence[int]]) -> list[list[int]]:
    red, green, blue = codes[4:7]
    return [list(green), _less(red, green), _less(blue, green)]


def _less(row: Sequence[int], other: Sequence[int]) -> list[int]:
    return [a - b for a, b in zip(row, other, strict=True)]


def _try(maker: _Maker, before: PlainState | None) -> PlainState | None:
    """Return the state; None if what was said leads to none."""
    try:
        state = maker.state_after(before)
    except (AssertionError, ValueError, IndexError, ZeroDivisionError):
        return None
    return state if maker.has_state else None


def _crc(head: Head, state: PlainState | None) -> int:
    if state is None:
        return 0
    return zlib.crc32(state.serialize(codes=state.phase % head.full_crc_interval == 0))
