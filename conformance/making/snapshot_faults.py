"""invalid/ and damaged/: faults in snapshots (SPEC 5.10, 7.9, 8.9, 11)."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from making.changes import Survivor
from making.fault_rows import RECOVERY_CLAUSES, count_frames, damaged_by
from making.frames import make_snapshot
from making.payloads import Snapshot, pack_index
from making.scenes import cloud
from making.snapshot_scenes import NEEDS, differences, survive, unchanged_survivors
from making.streams import Piece, assemble
from making.vectors import Gap, Outcome, Recovery, Valid, Vector, broken
from making.word_faults import state_code

_SNAP = 5
"""Piece of `streams/snapshots-journey` that holds frame 3, the first snapshot."""
_FRAME = 3
Row = tuple[str, str, str, list[Piece], str]


def make_snapshot_faults(parent: Valid, plain: Valid) -> list[Vector]:
    """Return all vectors.

    Args:
        parent: `streams/snapshots-journey`.
        plain: `streams/journey`, which has no snapshots.
    """
    rows = [*_of_fields(parent), *_of_scenes(parent), *_of_words(parent)]
    vectors = [
        *(_fault(parent, *row) for row in rows),
        *_of_indices(parent),
        *_damaged(parent),
        _first(parent),
    ]
    return [*(replace(vector, **NEEDS) for vector in vectors), _in_a_plain_stream(plain)]


def _payload(parent: Valid) -> Snapshot:
    payload = parent.stream.payloads[_FRAME]
    assert isinstance(payload, Snapshot)
    return payload


def _fault(
    parent: Valid, name: str, clauses: str, ids: str, pieces: list[Piece], note: str
) -> Vector:
    """A fault of the snapshot, after which decoding resumes at the next one."""
    said = Outcome(parent.frames[:_FRAME], tuple(ids.split()))
    vector = broken(parent, f"invalid/snapshot-{name}", clauses, pieces, said, note)
    offsets = assemble(pieces).offsets
    gap = Gap(offsets[_SNAP], offsets[_SNAP + 3] - offsets[_SNAP], said.refused, 3)
    frames = [*parent.frames[:_FRAME], *parent.frames[_FRAME + 3 :]]
    return replace(vector, recover=Recovery(frames, (gap,)))


def _of_fields(parent: Valid) -> Iterable[Row]:
    whole = _payload(parent)

    def said(**fields: Any) -> list[Piece]:
        payload = replace(whole, **fields).pack()
        return parent.stream.replaced(_SNAP, payload=payload)

    yield "repeated", "7.9-1", "frame-order", said(frame=2), "an ordinal is repeated"
    yield "skipped", "7.9-1", "frame-order", said(frame=4), "an ordinal is skipped"
    yield "of-no-canonical", "7.9-2", "frame-order", said(canonical=1), "the frame is not a CANO"
    yield "of-a-later-one", "7.9-2", "frame-order", said(canonical=8), "a later CANO"
    much = said(newborn_count=65537)
    note = "one newborn more than the Gaussians that level 1.0 allows"
    yield "newborn-beyond-level", "3.2-6 3.2-5", "count-exceeds-level", much, note
    most = said(newborn_count=(1 << 32) - 1)
    yield "newborn-greatest", "3.2-6 3.2-5", "count-exceeds-level", most, "2^32 - 1 newborn"
    yield "axis-bits", "5-2", "field", said(axis_bits=21), "axis_bits is 21"
    crc = said(state_crc=whole.state_crc ^ 1)
    yield "state-crc", "9.2-1", "state-crc", crc, "a bit of a state's CRC"
    payload = whole.pack()
    for name, data, ids, clauses, note in (
        ("shorter", payload[:-1], "field", "5-1", "the last byte is missing"),
        ("longer", payload + b"\0", "trailing-data", "5-3", "a byte after the last field"),
    ):
        yield name, clauses, ids, parent.stream.replaced(_SNAP, payload=data), note


def _of_scenes(parent: Valid) -> Iterable[Row]:
    before = parent.stream.states[_FRAME - 1]
    assert before is not None
    assert before.canonical is not None
    _, known = before.canonical

    def made(kept: Iterable[Survivor], newborn: Iterable[Any] = (), **said: Any) -> list[Piece]:
        snapshot, _ = make_snapshot(parent.stream.head, before, list(kept), list(newborn), **said)
        return parent.stream.replaced(_SNAP, payload=snapshot.pack())

    yield "empty", "7.9-3", "count", made(()), "no Gaussian at all"
    far = [replace(cloud(1, 5)[0], position=(1 << 20, 0, 0))]
    wide = made(unchanged_survivors(range(12)), far)
    yield "wide", "7.9-4", "symbol-range position-range", wide, "positions 2^20 steps or more apart"
    edge = [replace(cloud(1, 5)[0], position=(1 << 21, 0, 0))]
    note = "a position just beyond the lattice"
    yield "position", "7.9-5 4.1-1", "position-range", made((), edge), note
    for number, name in enumerate(("log-scale", "opacity", "red")):
        row = (7, 10, 11)[number]
        codes = [gaussian.codes[row - 7] for gaussian in known]
        i = next(i for i, code in enumerate(codes) if code)
        values = [0] * 14
        values[row] = 32767 if codes[i] > 0 else -32767
        pieces = made([Survivor(i, tuple(values))])
        yield name, "7.9-5 4.1-1", "code-range", pieces, f"{name} is beyond 32767"
    turned = made([Survivor(0, differences(rotation=(1, 256, 1, 0)))])
    note = "a rotation that is just too long"
    yield "rotation", "7.9-5", "rotation-range", turned, note
    turned = made([Survivor(0, differences(rotation=(0, 600, 0, 0)))])
    yield "component", "7.9-5", "rotation-range", turned, "a component beyond 1"
    other, _ = make_snapshot(parent.stream.head, before, survive(range(9), 9))
    pieces = parent.stream.replaced(_SNAP, payload=replace(other, state_crc=1).pack())
    yield "of-another-frame", "9.2-1", "state-crc", pieces, "another scene"


def _of_words(parent: Valid) -> Iterable[Row]:
    whole, left = _payload(parent), "unconsumed-words"

    def said(words: tuple[int, ...]) -> list[Piece]:
        payload = replace(whole, survivors=words).pack()
        return parent.stream.replaced(_SNAP, payload=payload)

    words = tuple(whole.survivors)
    yield "words-end-in-zero", "8.3-1", "invalid-words", said((*words, 0)), "a last word of 0"
    yield "words-left", "8.3-2 8.3-3", left, said((7, *words)), "a word before the first"
    yield "words-left-zero", "8.3-3", left, said((0, *words)), "a word of 0 before the first"
    for code in (240, 255):
        pieces = said(tuple(state_code(code)))
        yield f"probability-{code}", "8.2-1", "bad-probability", pieces, f"a stated code of {code}"


def _of_indices(parent: Valid) -> Iterable[Vector]:
    """INDX and TAIL with wrong information about snapshots."""
    pieces, offsets = parent.stream.pieces, parent.layout.offsets
    at = [n for n, piece in enumerate(pieces) if piece.kind in (b"CANO", b"SNAP")]
    frames = [0, 3, 6, 8, 10]
    points = [(offsets[n], n, frame) for n, frame in zip(at, frames, strict=True)]
    index = len(pieces) - 2
    bare = [p for p in points if pieces[p[1]].kind == b"CANO"]
    said = parent.stream.replaced(index, payload=pack_index(bare))
    outcome = Outcome(parent.frames, ("index-mismatch",))
    note = "INDX has no snapshot"
    name = "invalid/index-without-snapshots"
    yield broken(parent, name, "5.9-1 5.9-2", said, outcome, note)
    moved = [(o, n, 1 if frame == 0 else frame) for o, n, frame in points]
    said = parent.stream.replaced(index, payload=pack_index(moved))
    vector = broken(parent, "invalid/index-of-another-canonical", "11.2-5", said, outcome,
                    "no seek point has the ordinal that a snapshot names")  # fmt: skip
    refused = Outcome((), ("index-mismatch",))
    yield replace(vector, seek=tuple((f, refused) for f in (3, 4, 7)))
    swapped = [(offsets[at[1]], at[1], 0), *points[1:]]
    said = parent.stream.replaced(index, payload=pack_index(swapped))
    vector = broken(parent, "invalid/index-of-a-snapshot", "11.2-5", said, outcome,
                    "the seek point that a snapshot names is not of a CANO")  # fmt: skip
    yield replace(vector, seek=tuple((f, refused) for f in (3, 5, 6)))


def _damaged(parent: Valid) -> Iterable[Vector]:
    """Damage up to a canonical frame: with a CANO all its snapshots are lost, too."""
    rows = (
        (2, 0, 8, None, "first-canonical", "the first CANO"),
        (4, 2, 3, 1, "before", "the frame before a snapshot"),
        (5, 3, 6, 3, "snapshot", "a snapshot"),
        (8, 6, 8, 2, "later-snapshot", "a later snapshot"),
        (10, 8, None, 4, "canonical", "a CANO that is followed by a snapshot"),
        (12, 10, None, 2, "last-snapshot", "the last snapshot"),
    )
    pieces, offsets = parent.stream.pieces, parent.layout.offsets
    for place, before, after, lost, name, note in rows:
        spoiled = parent.stream.replaced(place, flip_byte=30)
        later = len(pieces) - 1
        if after is not None:
            later = next(
                n for n in range(place + 1, len(pieces)) if count_frames(pieces[:n]) == after
                and pieces[n].kind in (b"CANO", b"SNAP")
            )  # fmt: skip
        gap = Gap(offsets[place], offsets[later] - offsets[place], ("payload-crc",), lost)
        frames = [*parent.frames[:before], *parent.frames[after or 12 :]]
        yield damaged_by(
            parent,
            f"damaged/snapshots-{name}",
            RECOVERY_CLAUSES,
            assemble(spoiled).data,
            Outcome(parent.frames[:before], ("payload-crc",)),
            Recovery(frames, (gap,)),
            f"a bit of {note}",
        )


def _first(parent: Valid) -> Vector:
    """A snapshot before any CANO."""
    pieces = [p for n, p in enumerate(parent.stream.pieces) if n not in (2, 3, 4)]
    said = Outcome((), ("chunk-order",))
    note = "a snapshot precedes any CANO"
    return broken(parent, "invalid/snapshot-first", "5.1-3", pieces, said, note)


def _in_a_plain_stream(plain: Valid) -> Vector:
    place = next(n for n, piece in enumerate(plain.stream.pieces) if piece.kind == b"FRAM")
    snapshot = Snapshot(1, 0, 0, (0, 0, 0), 0, (), ((),) * 6, 0).pack()
    pieces = plain.stream.before(Piece(b"SNAP", snapshot), place=place)
    said = Outcome(plain.frames[:1], ("unknown-critical",))
    note = "a SNAP in a stream without FEATURE_SNAPSHOTS"
    vector = broken(plain, "invalid/snapshot-without-the-feature", "5.2-9", pieces, said, note)
    return replace(vector, recover=Recovery(said.frames, refused=said.refused))
