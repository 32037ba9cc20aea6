"""invalid/ and damaged/: faults in updates (SPEC 5.5, 7.8, 8.8, 12)."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from making.changes import Change, Update
from making.damaged_streams import flip, make_cut
from making.fault_rows import FRAM, HEAD, MOVED, Row, count_frames, faults_at, with_fields
from making.frames import make_frame
from making.lost_chunks import lose
from making.payloads import Frame
from making.scenes import moving, newborn
from making.streams import Piece
from making.update_scenes import drawn, leaving, residuals
from making.vectors import Outcome, Recovery, Valid, Vector, broken
from making.word_faults import state_code
from plain.state import PlainState

_FRAMES = (3, 4, 7, 8, 10)
"""Pieces of `streams/updates-journey` that hold frames 1, 2, 4, 5 and 7."""

_CODES = ("log-scale-x", "log-scale-y", "log-scale-z", "opacity", "red", "green", "blue")


def make_update_faults(parent: Valid, far: Valid, plain: Valid) -> list[Vector]:
    """Return all vectors.

    Args:
        parent: `streams/updates-journey`.
        far: `streams/updates-far`.
        plain: `streams/journey`, which has no updates.
    """
    vectors = [
        *faults_at(parent, FRAM, [*_of_states(parent), *_of_words(parent), *_of_layout(parent)]),
        *_of_places(far),
        *_of_features(parent),
        *_damaged(parent),
    ]
    return [
        *(replace(vector, needs="updates") for vector in vectors),
        *faults_at(plain, FRAM, _in_plain_streams(plain)),
    ]


def _before(parent: Valid, number: int = MOVED - 1) -> PlainState:
    state = parent.stream.states[number]
    assert state is not None
    return state


def _changed(parent: Valid, change: Change, **said: Any) -> list[Piece]:
    frame, _ = make_frame(parent.stream.head, _before(parent), change, **said)
    return parent.stream.replaced(FRAM, payload=frame.pack())


def _of_states(parent: Valid) -> Iterable[Row]:
    gaussians = _before(parent).gaussians
    count = len(gaussians)

    def updated(*updates: Update, **more: Any) -> list[Piece]:
        return _changed(parent, Change(updates=updates, **more))

    note = "all Gaussians leave"
    yield "updates-all-leave", "7.8-1", "count", updated(*leaving(range(count))), note
    pieces = _changed(parent, Change(deaths=3, updates=leaving(range(count - 3))))
    yield (
        "updates-rest-leaves",
        "7.8-1",
        "count",
        pieces,
        "the Gaussians that survive the deaths leave",
    )
    for row, name in enumerate(_CODES):
        i = next(i for i, g in enumerate(gaussians) if g.codes[row])
        much = 32767 if gaussians[i].codes[row] > 0 else -32767
        said = (0,) * (6 + row) + (much,) + (0,) * (6 - row)
        note = f"{name} is beyond 32767 by its residual"
        pieces = updated(Update(i, said))
        yield f"updates-{name}", "7.8-3 4.1-1", "code-range", pieces, note
    for name, turned in {
        "turn": (257, 0, 0),
        "turn-negative": (0, -257, 0),
        "turn-z": (0, 0, 257),
        "turn-far": (32767, 32767, -32767),
    }.items():
        pieces = updated(Update(4, residuals(rotation=turned)))
        yield f"updates-{name}", "7.8-4", "symbol-range", pieces, f"a rotation residual of {turned}"
    pieces = updated(*leaving((0, 5)), births=newborn([0, count - 2], 40))
    note = "the index of the parent would be valid only before Gaussians left"
    yield "updates-parent", "7.6-1 7.8", "parent-range", pieces, note
    frame = parent.stream.payloads[MOVED]
    assert isinstance(frame, Frame)
    crcs = {
        "state-crc": (frame.state_crc ^ 1, "a bit of a state's CRC"),
        "state-crc-before": (_crc_without_updates(parent), "the CRC of the state without updates"),
    }
    for name, (crc, note) in crcs.items():
        pieces = with_fields(parent, MOVED, state_crc=crc)
        yield f"updates-{name}", "9.2-1 7.8", "state-crc", pieces, note
    other, _ = make_frame(parent.stream.head, _before(parent), Change(updates=drawn(12, 99)))
    pieces = with_fields(parent, MOVED, updates=other.updates)
    yield "updates-of-another-frame", "9.2-1", "state-crc unconsumed-words", pieces, "other updates"


def _crc_without_updates(parent: Valid) -> int:
    frame, _ = make_frame(parent.stream.head, _before(parent), Change(moving(7, 4)))
    return frame.state_crc


def _of_words(parent: Valid) -> Iterable[Row]:
    frame = parent.stream.payloads[MOVED]
    assert isinstance(frame, Frame)
    for code in (240, 255):
        # Without motion the first plane has one context, as after every canonical frame.
        pieces = with_fields(parent, MOVED, motion=(), updates=state_code(code))
        note = f"a stated code of {code}"
        yield f"updates-probability-{code}", "8.2-1", "bad-probability", pieces, note
    words = tuple(frame.updates or ())
    left = "unconsumed-words"
    changed = {
        "words-end-in-zero": ((*words, 0), "invalid-words", "8.3-1", "a word of 0 after the last"),
        "words-zero": ((0,), "invalid-words", "8.3-1", "a section of one word, which is 0"),
        "words-left": ((7, *words), left, "8.3-2 8.3-3", "a word before the first"),
        "words-left-zero": ((0, *words), left, "8.3-3", "a word of 0 before the first"),
        "words-for-nothing": ((1,), left, "8.3-2", "a word of zero bits, which leaves a state"),
    }
    for name, (said, ids, clauses, note) in changed.items():
        pieces = with_fields(parent, MOVED, updates=said)
        yield f"updates-{name}", clauses, ids, pieces, note


def _of_layout(parent: Valid) -> Iterable[Row]:
    frame = parent.stream.payloads[MOVED]
    assert isinstance(frame, Frame)
    whole, bare = frame.pack(), replace(frame, updates=None).pack()
    place = len(bare) - 8 - 4 * len(frame.births)  # of the updates' word_count
    counts = {"beyond": len(frame.updates or ()) + 1 << 8, "greatest": (1 << 32) - 1}
    rows = {
        "section-missing": (bare, "field", "5-1", "a FRAM without the section of updates"),
        "shorter": (whole[:-1], "field", "5-1", "the last byte of a FRAM is missing"),
        "longer": (whole + b"\0", "trailing-data", "5-3", "a byte after the last field"),
        **{
            f"word-count-{name}": (
                whole[:place] + count.to_bytes(4, "little") + whole[place + 4 :],
                *("field", "5-1 13-1", f"word_count of updates is {count}"),
            )
            for name, count in counts.items()
        },
    }
    for name, (payload, ids, clauses, note) in rows.items():
        pieces = parent.stream.replaced(FRAM, payload=payload)
        yield f"updates-{name}", clauses, ids, pieces, note


def _in_plain_streams(plain: Valid) -> Iterable[Row]:
    frame = plain.stream.payloads[MOVED]
    assert isinstance(frame, Frame)
    payload = replace(frame, updates=()).pack()
    pieces = plain.stream.replaced(FRAM, payload=payload)
    note = "a section of updates in a stream without FEATURE_UPDATES"
    yield "updates-without-the-feature", "5-3 12-2", "trailing-data", pieces, note


def _of_places(far: Valid) -> Iterable[Vector]:
    """The stream across the lattice, with an additional frame that is rejected."""
    before = _before(far, -1)
    places = [g.position for g in before.gaussians]
    step = far.stream.head.translation_step
    much = (8388607 - places[0][1]) // step + 1
    cases = {
        "beyond": ((0, much, 0), "a Gaussian is moved just beyond the lattice"),
        "below": (
            ((-8388607 - places[0][0]) // step - 1, 0, 0),
            "a Gaussian is moved below the lattice",
        ),
        "wraps": ((0, 32767, 0), "a translation that does not fit into 32 bits"),
    }
    for name, (said, note) in cases.items():
        change = Change(updates=(Update(0, residuals(translation=said)),))
        frame, _ = make_frame(far.stream.head, before, change)
        piece = Piece(b"FRAM", frame.pack())
        pieces = far.stream.before(piece, place=len(far.stream.pieces) - 1)
        outcome = Outcome(far.frames, ("position-range",))
        yield broken(far, f"invalid/updates-{name}", "7.8-2 4.1-1", pieces, outcome, note)


def _of_features(parent: Valid) -> Iterable[Vector]:
    head = parent.stream.head
    for mask in (3, 10, 0x80000002):
        payload = replace(head, incompatible_features=mask).pack()
        pieces = parent.stream.replaced(HEAD, payload=payload)
        said, note = Outcome((), ("unsupported-feature",)), f"incompatible_features {mask:#x}"
        name = f"invalid/updates-features-{mask:x}"
        vector = broken(parent, name, "12-2", pieces, said, note)
        yield replace(vector, recover=Recovery((), refused=said.refused))


def _damaged(parent: Valid) -> Iterable[Vector]:
    offsets = parent.layout.offsets
    for place in _FRAMES:
        yield from flip(parent, place, f"updates-flip-{place:02}")
        before = count_frames(parent.stream.pieces[:place])
        yield lose(parent, f"damaged/updates-lost-{place:02}", [place], before, "a FRAM")
        size = offsets[place + 1] - 12
        note = f"cut in the payload of chunk {place}"
        yield make_cut(parent, size, f"damaged/updates-cut-{place:02}", note)
