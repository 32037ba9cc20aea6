"""invalid/: frames that are no state (SPEC 7, 9)."""

import zlib
from collections.abc import Iterable
from dataclasses import replace

from making.fault_rows import (
    CANO,
    FRAM,
    MOVED,
    Row,
    faults_at,
    with_fields,
)
from making.frames import Change, make_canonical, make_frame
from making.scenes import cloud, moving, newborn
from making.streams import Piece
from making.vectors import Outcome, Valid, Vector, broken


def make_state_faults(parent: Valid) -> list[Vector]:
    """Return streams whose frame 4 is no state, patches of the journey."""
    return [
        *faults_at(parent, FRAM, _of_states(parent)),
        *faults_at(parent, CANO, _of_scenes(parent)),
    ]


def _of_states(parent: Valid) -> Iterable[Row]:
    stream, before = parent.stream, parent.stream.states[3]
    assert before is not None

    def changed(change: Change) -> list[Piece]:
        return stream.replaced(FRAM, payload=make_frame(stream.head, before, change)[0].pack())

    good = newborn([0, 5], 40)
    unit = 1 << stream.head.rotation_bits
    count = len(before.gaussians)
    back = [0, 0, 0, -1, 0, 0, 0]

    def born(**said: object) -> list[Piece]:
        return changed(Change(births=(good[0], replace(good[1], **said))))

    codes = good[1].codes
    yield (
        "degenerate-rotation",
        "7.3-1",
        "degenerate-rotation",
        changed(Change(lambda _level, _anchor: back)),
        "residuals of w that add up to minus the identity",
    )
    yield (
        "parent-beyond",
        "7.6-1",
        "parent-range",
        born(parent=count),
        "the parent is the newborn before it",
    )
    yield (
        "parent-far-beyond",
        "7.6-1",
        "parent-range",
        born(parent=1 << 40),
        "the index of a parent is 2^40",
    )
    yield (
        "parent-wraps",
        "7.6-1 4.1-1",
        "parent-range",
        born(parent=1 << 32),
        "the index of a parent is 2^32: 0 in 32 bits",
    )
    yield (
        "newborn-rotation",
        "7.6-4",
        "rotation-range",
        born(rotation=(0, unit, 1, 0)),
        "a rotation that is just too long",
    )
    yield (
        "newborn-component",
        "7.6-4",
        "rotation-range",
        born(rotation=(0, unit + 1, 0, 0)),
        "a component beyond 1",
    )
    yield (
        "newborn-code",
        "7.6-3",
        "code-range",
        born(codes=(*codes[:4], 32767 + 1, 1, 1, *codes[7:])),
        "red is 32768 by its difference from green",
    )
    yield (
        "newborn-code-negative",
        "7.6-3",
        "code-range",
        born(codes=(*codes[:4], 1, -1, -32768, *codes[7:])),
        "blue is -32768",
    )
    yield (
        "newborn-scale",
        "7.6-3",
        "code-range",
        born(codes=(-32767, -32766, -32768, *codes[3:])),
        "a log-scale is -32768 by differences",
    )
    crc = stream.payloads[MOVED].state_crc
    yield (
        "state-crc",
        "9.2-1 9.2-2",
        "state-crc",
        with_fields(parent, MOVED, state_crc=crc ^ 1),
        "a bit of a state's CRC",
    )
    yield (
        "state-crc-of-the-codes",
        "9.2-1",
        "state-crc",
        with_fields(parent, MOVED, state_crc=_crc_of_all(parent)),
        "a CRC over all fields where one without codes is due",
    )
    yield (
        "state-crc-zero",
        "9.2-1",
        "state-crc",
        with_fields(parent, MOVED, state_crc=0),
        "a CRC of 0 does not stand for none",
    )
    later = replace(before, phase=before.phase + 0)
    other, _ = make_frame(stream.head, later, Change(moving(7, 99)))
    yield (
        "state-of-another-frame",
        "9.2-1",
        "state-crc",
        with_fields(parent, MOVED, motion=other.motion),
        "the motion of another frame",
    )


def _crc_of_all(parent: Valid) -> int:

    state = parent.stream.states[MOVED]
    assert state is not None
    return zlib.crc32(state.serialize())


def _of_scenes(parent: Valid) -> Iterable[Row]:
    stream = parent.stream

    gaussians = cloud(12, 3, reach=20)
    unit = 1 << stream.head.rotation_bits
    last = gaussians[11]

    def scene(**said: object) -> list[Piece]:
        changed = [*gaussians[:11], replace(last, **said)]
        return stream.replaced(CANO, payload=make_canonical(stream.head, 3, changed)[0].pack())

    far = 1 << 21  # position_step is 4
    most = max(v for g in gaussians for v in g.position)
    least = min(v for g in gaussians for v in g.position)
    shifted = tuple(
        replace(g, position=tuple(v + far - most for v in g.position)) for g in gaussians
    )
    payload = make_canonical(stream.head, 3, shifted)[0].pack()
    low = tuple(replace(g, position=tuple(v - far - least for v in g.position)) for g in gaussians)
    yield (
        "position",
        "7.2-3 4.1-1",
        "position-range",
        stream.replaced(CANO, payload=payload),
        "a canonical position just beyond the lattice",
    )
    yield (
        "position-negative",
        "7.2-3 4.1-1",
        "position-range",
        stream.replaced(CANO, payload=make_canonical(stream.head, 3, low)[0].pack()),
        "a position of -2^23, which 24 bits would hold",
    )
    yield (
        "position-wraps",
        "7.2-3 4.1-1",
        "position-range",
        with_fields(parent, 3, origin=(1 << 30, 0, 0)),
        "an origin whose positions are small modulo 2^32",
    )
    yield (
        "code",
        "7.2-4",
        "code-range",
        scene(codes=(*last.codes[:4], 32768, 1, 1, *last.codes[7:])),
        "red is 32768 by its difference from green",
    )
    yield (
        "code-negative",
        "7.2-4",
        "code-range",
        scene(codes=(*last.codes[:4], 1, -1, -32768, *last.codes[7:])),
        "blue is -32768",
    )
    yield (
        "rotation",
        "7.2-6",
        "rotation-range",
        scene(rotation=(2, unit, 0, 1)),
        "a rotation that is just too long",
    )
    yield (
        "rotation-component",
        "7.2-5",
        "rotation-range",
        scene(rotation=(1, 0, -unit - 1, 0)),
        "a component beyond 1",
    )
    yield (
        "rotation-long",
        "7.2-6",
        "rotation-range",
        scene(rotation=(3, unit, unit, -unit)),
        "three components of 1",
    )


def make_motion_faults(parent: Valid) -> list[Vector]:
    """Return streams whose last frame leaves the lattice, patches of `traps/lattice-edge`."""
    stream, before = parent.stream, parent.stream.states[-1]
    assert before is not None
    cases = {
        "moved-beyond": (
            [1, 0, 0, 0, 0, 0],
            "7.5-1 4.1-1",
            "a Gaussian moves just beyond the lattice",
        ),
        "moved-beyond-negative": (
            [0, -1, 0, 0, 0, 0],
            "7.5-1 4.1-1",
            "a Gaussian moves to less than the least position",
        ),
        "moved-far-beyond": (
            [0, 0, 65, 0, 0, 0],
            "7.5-1 4.1-1",
            "a Gaussian moves far beyond the lattice",
        ),
    }
    tail = len(stream.pieces) - 1
    vectors = []
    for name, (symbols, clauses, note) in cases.items():
        frame, _ = make_frame(stream.head, before, Change(lambda _level, _anchor, s=symbols: s))
        pieces = stream.before(Piece(b"FRAM", frame.pack()), place=tail)
        outcome = Outcome(parent.frames, ("position-range",))
        vectors.append(broken(parent, f"invalid/{name}", clauses, pieces, outcome, note))
    parents = [g.position[0] for g in before.gaussians]
    child = replace(newborn([parents.index(max(parents))], 1, 0)[0], position=(1, 0, 0))
    frame, _ = make_frame(stream.head, before, Change(births=(child,)))
    pieces = stream.before(Piece(b"FRAM", frame.pack()), place=tail)
    outcome = Outcome(parent.frames, ("position-range",))
    vectors.append(
        broken(
            parent,
            "invalid/newborn-beyond",
            "7.6-2 4.1-1",
            pieces,
            outcome,
            "a newborn beyond the lattice",
        )
    )
    return vectors
