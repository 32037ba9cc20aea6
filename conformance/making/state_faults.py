"""invalid/: frames whose state is invalid (SPEC 7, 9)."""

import zlib
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from making.changes import Change, Coded
from making.fault_rows import CANO, FRAM, MOVED, Row, faults_at, with_fields
from making.frames import make_canonical, make_frame
from making.scenes import cloud, moving, newborn
from making.streams import Piece
from making.vectors import Outcome, Valid, Vector, broken
from plain.state import PlainState

_UNIT = 1 << 8  # 2^rotation_bits of the journey
_MUCH = "32768 by its difference from green"
Wrong = tuple[str, str, str, dict[str, Any], str]
"""Name, clause, reject id, coded values of a Gaussian, and description."""

_NEWBORN: tuple[Wrong, ...] = (
    ("parent-far-beyond", "7.6-1", "parent-range", {"parent": 1 << 40}, "a parent of index 2^40"),
    (
        *("parent-wraps", "7.6-1 4.1-1", "parent-range", {"parent": 1 << 32}),
        "the index of a parent is 2^32: 0 in 32 bits",
    ),
    (
        *("newborn-rotation", "7.6-4", "rotation-range", {"rotation": (0, _UNIT, 1, 0)}),
        "a rotation that is just too long",
    ),
    (
        *("newborn-component", "7.6-4", "rotation-range", {"rotation": (0, _UNIT + 1, 0, 0)}),
        "a component beyond 1",
    ),
)
_ROTATIONS: tuple[Wrong, ...] = (
    (
        *("rotation", "7.2-6", "rotation-range", {"rotation": (2, _UNIT, 0, 1)}),
        "a rotation that is just too long",
    ),
    (
        *("rotation-component", "7.2-5", "rotation-range", {"rotation": (1, 0, -_UNIT - 1, 0)}),
        "a component beyond 1",
    ),
    (
        *("rotation-long", "7.2-6", "rotation-range", {"rotation": (3, _UNIT, _UNIT, -_UNIT)}),
        "three components of 1",
    ),
)


def make_state_faults(parent: Valid) -> list[Vector]:
    """Return streams with an invalid state in frame 4 or 3, as patches of the journey."""
    return [
        *faults_at(parent, FRAM, [*_of_newborn(parent), *_of_crcs(parent)]),
        *faults_at(parent, CANO, [*_of_places(parent), *_of_gaussians(parent)]),
    ]


def _before(parent: Valid) -> PlainState:
    state = parent.stream.states[MOVED - 1]
    assert state is not None
    return state


def _changed(parent: Valid, change: Change) -> list[Piece]:
    frame, _ = make_frame(parent.stream.head, _before(parent), change)
    return parent.stream.replaced(FRAM, payload=frame.pack())


def _of_newborn(parent: Valid) -> Iterable[Row]:
    first, second = newborn([0, 5], 40)
    codes, count = second.codes, len(_before(parent).gaussians)

    def born(**said: Any) -> list[Piece]:
        return _changed(parent, Change(births=(first, replace(second, **said))))

    back = _changed(parent, Change(lambda _level, _anchor: [0, 0, 0, -1, 0, 0, 0]))
    note = "residuals of w that add up to minus the identity"
    yield "degenerate-rotation", "7.3-1", "degenerate-rotation", back, note
    note = "the parent is the newborn before it"
    yield "parent-beyond", "7.6-1", "parent-range", born(parent=count), note
    for name, clauses, ids, said, note in _NEWBORN:
        yield name, clauses, ids, born(**said), note
    for name, said_codes, note in _of_codes("newborn-code", codes):
        yield name, "7.6-3", "code-range", born(codes=said_codes), note
    scales, note = (-32767, -32766, -32768, *codes[3:]), "a log-scale is -32768 by differences"
    yield "newborn-scale", "7.6-3", "code-range", born(codes=scales), note


def _of_codes(name: str, codes: tuple[int, ...]) -> Iterable[tuple[str, tuple[int, ...], str]]:
    """Colors just out of range, with differences in range."""
    yield name, (*codes[:4], 32768, 1, 1, *codes[7:]), f"red is {_MUCH}"
    yield f"{name}-negative", (*codes[:4], 1, -1, -32768, *codes[7:]), f"blue is -{_MUCH}"


def _of_crcs(parent: Valid) -> Iterable[Row]:
    state, frame = parent.stream.states[MOVED], parent.stream.payloads[MOVED]
    assert state is not None
    crcs = {
        "state-crc": (frame.state_crc ^ 1, "9.2-1 9.2-2", "a bit of a state's CRC"),
        "state-crc-of-the-codes": (
            *(zlib.crc32(state.serialize()), "9.2-1"),
            "a CRC over all fields instead of one without codes",
        ),
        "state-crc-zero": (0, "9.2-1", "a CRC of 0 does not mean that there is none"),
    }
    for name, (crc, clauses, note) in crcs.items():
        yield name, clauses, "state-crc", with_fields(parent, MOVED, state_crc=crc), note
    other, _ = make_frame(parent.stream.head, _before(parent), Change(moving(7, 99)))
    pieces = with_fields(parent, MOVED, motion=other.motion)
    yield "state-of-another-frame", "9.2-1", "state-crc", pieces, "the motion of another frame"


def _scene(parent: Valid, gaussians: Iterable[Coded]) -> list[Piece]:
    canonical, _ = make_canonical(parent.stream.head, 3, list(gaussians))
    return parent.stream.replaced(CANO, payload=canonical.pack())


def _of_places(parent: Valid) -> Iterable[Row]:
    gaussians, far = cloud(12, 3, reach=20), 1 << 21  # position_step is 4
    values = [v for g in gaussians for v in g.position]

    def shifted(by: int) -> list[Piece]:
        places = ((g, tuple(v + by for v in g.position)) for g in gaussians)
        return _scene(parent, (replace(g, position=place) for g, place in places))

    wrapped = with_fields(parent, 3, origin=(1 << 30, 0, 0))
    cases = {
        "position": (shifted(far - max(values)), "a position just beyond the lattice"),
        "position-negative": (
            shifted(-far - min(values)),
            "a position of -2^23, which 24 bits could hold",
        ),
        "position-wraps": (wrapped, "an origin whose positions are small modulo 2^32"),
    }
    for name, (pieces, note) in cases.items():
        yield name, "7.2-3 4.1-1", "position-range", pieces, note


def _of_gaussians(parent: Valid) -> Iterable[Row]:
    *others, last = cloud(12, 3, reach=20)
    for name, codes, note in _of_codes("code", last.codes):
        pieces = _scene(parent, [*others, replace(last, codes=codes)])
        yield name, "7.2-4", "code-range", pieces, note
    for name, clauses, ids, said, note in _ROTATIONS:
        yield name, clauses, ids, _scene(parent, [*others, replace(last, **said)]), note


_STEPS: dict[str, tuple[list[int], str]] = {
    "moved-beyond": ([1, 0, 0, 0, 0, 0], "a Gaussian moves just beyond the lattice"),
    "moved-beyond-negative": ([0, -1, 0, 0, 0, 0], "a Gaussian moves below the least position"),
    "moved-far-beyond": ([0, 0, 65, 0, 0, 0], "a Gaussian moves far beyond the lattice"),
}


def make_motion_faults(parent: Valid) -> list[Vector]:
    """Return streams whose last frame leaves the lattice, as patches of one at its edge."""
    before = parent.stream.states[-1]
    assert before is not None
    places = [g.position[0] for g in before.gaussians]
    child = replace(newborn([places.index(max(places))], 1, 0)[0], position=(1, 0, 0))
    vectors = [
        _append(parent, name, "7.5-1", Change(_always(symbols)), note)
        for name, (symbols, note) in _STEPS.items()
    ]
    note = "a newborn beyond the lattice"
    return [*vectors, _append(parent, "newborn-beyond", "7.6-2", Change(births=(child,)), note)]


def _always(symbols: list[int]) -> Callable[[int, int], list[int]]:
    return lambda _level, _anchor: symbols


def _append(parent: Valid, name: str, clause: str, change: Change, note: str) -> Vector:
    """The parent with an additional frame, which is rejected."""
    stream, before = parent.stream, parent.stream.states[-1]
    assert before is not None
    frame, _ = make_frame(stream.head, before, change)
    pieces = stream.before(Piece(b"FRAM", frame.pack()), place=len(stream.pieces) - 1)
    said = Outcome(parent.frames, ("position-range",))
    return broken(parent, f"invalid/{name}", f"{clause} 4.1-1", pieces, said, note)
