"""Makes vectors in invalid/ and damaged/: faults in updates (SPEC 5.5, 7.8, 8.8, 12)."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from making.changes import Change, SymbolChoice, Update
from making.damaged_streams import make_cut_vector, make_flip_vectors
from making.fault_rows import (
    FRAM_CHUNK_INDEX,
    FRAM_ORDINAL,
    HEAD_CHUNK_INDEX,
    FaultRow,
    count_frames,
    make_faults_at,
    replace_frame_fields,
)
from making.frames import make_frame
from making.lost_chunks import make_loss_vector
from making.payloads import Frame
from making.scenes import make_births, make_moving_symbols
from making.streams import Chunk, describe_state
from making.update_scenes import make_deleting_updates, make_random_updates, make_residuals
from making.vectors import Outcome, Recovery, ValidStream, Vector, make_patched_vector
from making.word_faults import encode_stated_code
from plain.state import PlainState

_FRAME_CHUNK_INDICES = (3, 4, 7, 8, 10)
"""Indices of the chunks of `streams/updates-journey` that hold frames 1, 2, 4, 5 and 7."""

_CODE_NAMES = ("log-scale-x", "log-scale-y", "log-scale-z", "opacity", "red", "green", "blue")


def make_update_faults(
    parent: ValidStream, updates_far: ValidStream, journey: ValidStream
) -> list[Vector]:
    """Return all vectors.

    Args:
        parent: `streams/updates-journey`.
        updates_far: `streams/updates-far`.
        journey: `streams/journey`, which has no updates.
    """
    vectors = [
        *make_faults_at(
            parent,
            FRAM_CHUNK_INDEX,
            [*_list_state_faults(parent), *_list_word_faults(parent), *_list_layout_faults(parent)],
        ),
        *_make_position_faults(updates_far),
        *_make_feature_faults(parent),
        *_make_damaged_vectors(parent),
    ]
    return [
        *(replace(vector, needs="updates") for vector in vectors),
        *make_faults_at(journey, FRAM_CHUNK_INDEX, _list_faults_without_feature(journey)),
    ]


def _get_previous_state(parent: ValidStream, number: int = FRAM_ORDINAL - 1) -> PlainState:
    state = parent.stream.states[number]
    assert state is not None
    return state


def _replace_frame(parent: ValidStream, change: Change, **overrides: Any) -> list[Chunk]:
    frame, _ = make_frame(parent.stream.head, _get_previous_state(parent), change, **overrides)
    return parent.stream.replace_chunk(FRAM_CHUNK_INDEX, payload=frame.pack())


def _list_state_faults(parent: ValidStream) -> Iterable[FaultRow]:
    gaussians = _get_previous_state(parent).gaussians
    count = len(gaussians)

    def make_chunks(*updates: Update, **changes: Any) -> list[Chunk]:
        return _replace_frame(parent, Change(updates=updates, **changes))

    note = "updates delete all Gaussians"
    yield (
        "updates-all-leave",
        "7.8-1",
        "count",
        make_chunks(*make_deleting_updates(range(count))),
        note,
    )
    chunks = _replace_frame(
        parent, Change(death_count=3, updates=make_deleting_updates(range(count - 3)))
    )
    yield (
        "updates-rest-leaves",
        "7.8-1",
        "count",
        chunks,
        "updates delete all Gaussians that survive the deaths",
    )
    for row, name in enumerate(_CODE_NAMES):
        i = next(i for i, g in enumerate(gaussians) if g.codes[row])
        code_change = 32767 if gaussians[i].codes[row] > 0 else -32767
        wrong_residuals = (0,) * (6 + row) + (code_change,) + (0,) * (6 - row)
        note = f"a residual makes the magnitude of {name} larger than 32767"
        chunks = make_chunks(Update(i, wrong_residuals))
        yield f"updates-{name}", "7.8-3 4.1-1", "code-range", chunks, note
    for name, rotation in {
        "turn": (257, 0, 0),
        "turn-negative": (0, -257, 0),
        "turn-z": (0, 0, 257),
        "turn-far": (32767, 32767, -32767),
    }.items():
        chunks = make_chunks(Update(4, make_residuals(rotation=rotation)))
        yield (
            f"updates-{name}",
            "7.8-4",
            "symbol-range",
            chunks,
            f"a rotation residual of {rotation}",
        )
    chunks = make_chunks(*make_deleting_updates((0, 5)), births=make_births([0, count - 2], 40))
    note = "the index of a parent is valid only before updates delete Gaussians"
    yield "updates-parent", "7.6-1 7.8", "parent-range", chunks, note
    frame = parent.stream.frame_payloads[FRAM_ORDINAL]
    assert isinstance(frame, Frame)
    crcs = {
        "state-crc": (frame.state_crc ^ 1, "one bit of the state CRC is flipped"),
        "state-crc-before": (
            _compute_crc_without_updates(parent),
            "the state CRC is that of the state without updates",
        ),
    }
    for name, (crc, note) in crcs.items():
        chunks = replace_frame_fields(parent, FRAM_ORDINAL, state_crc=crc)
        yield f"updates-{name}", "9.2-1 7.8", "state-crc", chunks, note
    other_frame, _ = make_frame(
        parent.stream.head, _get_previous_state(parent), Change(updates=make_random_updates(12, 99))
    )
    chunks = replace_frame_fields(parent, FRAM_ORDINAL, updates=other_frame.updates)
    yield (
        "updates-of-another-frame",
        "9.2-1",
        "state-crc unconsumed-words",
        chunks,
        "the updates section is that of another frame",
    )


def _compute_crc_without_updates(parent: ValidStream) -> int:
    frame, _ = make_frame(
        parent.stream.head, _get_previous_state(parent), Change(make_moving_symbols(7, 4))
    )
    return frame.state_crc


def _list_word_faults(parent: ValidStream) -> Iterable[FaultRow]:
    frame = parent.stream.frame_payloads[FRAM_ORDINAL]
    assert isinstance(frame, Frame)
    for code in (240, 255):
        # Without motion, the first plane has one context, as it does after a canonical frame.
        chunks = replace_frame_fields(
            parent, FRAM_ORDINAL, motion=(), updates=encode_stated_code(code)
        )
        note = f"a stated probability code of {code}"
        yield f"updates-probability-{code}", "8.2-1", "bad-probability", chunks, note
    words = tuple(frame.updates or ())
    unconsumed_id = "unconsumed-words"
    word_cases = {
        "words-end-in-zero": (
            (*words, 0),
            "invalid-words",
            "8.3-1",
            "an extra zero word after the last word of the updates section",
        ),
        "words-zero": ((0,), "invalid-words", "8.3-1", "the only word of the updates section is 0"),
        "words-left": (
            (7, *words),
            unconsumed_id,
            "8.3-2 8.3-3",
            "an extra word before the first word of the updates section",
        ),
        "words-left-zero": (
            (0, *words),
            unconsumed_id,
            "8.3-3",
            "an extra zero word before the first word of the updates section",
        ),
        "words-for-nothing": (
            (1,),
            unconsumed_id,
            "8.3-2",
            "a word that codes only zeros but leaves a nonzero coder state",
        ),
    }
    for name, (wrong_words, reject_id, clauses, note) in word_cases.items():
        chunks = replace_frame_fields(parent, FRAM_ORDINAL, updates=wrong_words)
        yield f"updates-{name}", clauses, reject_id, chunks, note


def _list_layout_faults(parent: ValidStream) -> Iterable[FaultRow]:
    frame = parent.stream.frame_payloads[FRAM_ORDINAL]
    assert isinstance(frame, Frame)
    payload_with_updates, payload_without_updates = (
        frame.pack(),
        replace(frame, updates=None).pack(),
    )
    word_count_offset = len(payload_without_updates) - 8 - 4 * len(frame.births)
    word_counts = {"beyond": len(frame.updates or ()) + 1 << 8, "greatest": (1 << 32) - 1}
    layout_cases = {
        "section-missing": (
            payload_without_updates,
            "field",
            "5-1",
            "a FRAM without an updates section, although FEATURE_UPDATES is set",
        ),
        "shorter": (
            payload_with_updates[:-1],
            "field",
            "5-1",
            "the last byte of a FRAM is missing",
        ),
        "longer": (
            payload_with_updates + b"\0",
            "trailing-data",
            "5-2",
            "an additional byte after the last field of a FRAM",
        ),
        **{
            f"word-count-{name}": (
                payload_with_updates[:word_count_offset]
                + count.to_bytes(4, "little")
                + payload_with_updates[word_count_offset + 4 :],
                *("field", "5-1 13-1", f"word_count of updates is {count}"),
            )
            for name, count in word_counts.items()
        },
    }
    for name, (payload, reject_id, clauses, note) in layout_cases.items():
        chunks = parent.stream.replace_chunk(FRAM_CHUNK_INDEX, payload=payload)
        yield f"updates-{name}", clauses, reject_id, chunks, note


def _list_faults_without_feature(journey: ValidStream) -> Iterable[FaultRow]:
    frame = journey.stream.frame_payloads[FRAM_ORDINAL]
    assert isinstance(frame, Frame)
    payload = replace(frame, updates=()).pack()
    chunks = journey.stream.replace_chunk(FRAM_CHUNK_INDEX, payload=payload)
    note = "an updates section in a stream without FEATURE_UPDATES"
    yield "updates-without-the-feature", "5-2 12-2", "trailing-data", chunks, note


def _make_position_faults(updates_far: ValidStream) -> Iterable[Vector]:
    """Yield `streams/updates-far` with an added frame that moves a Gaussian out of the lattice."""
    previous = _get_previous_state(updates_far, -1)
    positions = [g.position for g in previous.gaussians]
    step = updates_far.stream.head.translation_step
    steps_beyond_edge = (8388607 - positions[0][1]) // step + 1
    cases = {
        "beyond": ((0, steps_beyond_edge, 0), "an update moves a Gaussian just beyond the lattice"),
        "below": (
            ((-8388607 - positions[0][0]) // step - 1, 0, 0),
            "an update moves a Gaussian beyond the lattice in the negative direction",
        ),
        "wraps": ((0, 32767, 0), "an update moves a Gaussian far beyond the lattice"),
    }
    for name, (translation, note) in cases.items():
        change = Change(updates=(Update(0, make_residuals(translation=translation)),))
        frame, _ = make_frame(updates_far.stream.head, previous, change)
        chunk = Chunk(b"FRAM", frame.pack())
        chunks = updates_far.stream.insert_chunks(chunk, index=len(updates_far.stream.chunks) - 1)
        outcome = Outcome(updates_far.frames, ("position-range",))
        yield make_patched_vector(
            updates_far, f"invalid/updates-{name}", "7.8-2 4.1-1", chunks, outcome, note
        )
    yield _make_returning_vector(updates_far, steps_beyond_edge - 1)


def _make_returning_vector(updates_far: ValidStream, steps_to_edge: int) -> Vector:
    """Return two more frames: to the edge of the lattice; beyond it and, by an update, back."""
    head, chunks = updates_far.stream.head, updates_far.stream.chunks
    to_edge = (Update(0, make_residuals(translation=(0, steps_to_edge, 0))),)
    back = (Update(0, make_residuals(translation=(0, -1, 0))),)
    first, state = make_frame(head, _get_previous_state(updates_far, -1), Change(updates=to_edge))
    assert state is not None
    inward, _ = make_frame(head, state, Change(_move_along_y(-1), updates=back))
    outward, _ = make_frame(head, state, Change(_move_along_y(1), update_words=inward.updates))
    added_chunks = [Chunk(b"FRAM", frame.pack()) for frame in (first, outward)]
    return make_patched_vector(
        updates_far,
        "invalid/updates-return",
        "7.5-1 7.8",
        [*chunks[:-1], *added_chunks, chunks[-1]],
        Outcome([*updates_far.frames, describe_state(state)], ("position-range",)),
        "the motion moves a Gaussian beyond the lattice, and an update moves it back",
    )


def _move_along_y(steps: int) -> SymbolChoice:
    """Return the same motion for all anchors of level 1, and none for the others."""
    return lambda level, _anchor: [0, steps, 0, 0, 0, 0] if level == 1 else None


def _make_feature_faults(parent: ValidStream) -> Iterable[Vector]:
    head = parent.stream.head
    for mask in (3, 10, 0x80000002):
        payload = replace(head, incompatible_features=mask).pack()
        chunks = parent.stream.replace_chunk(HEAD_CHUNK_INDEX, payload=payload)
        outcome, note = Outcome((), ("unsupported-feature",)), f"incompatible_features is {mask:#x}"
        name = f"invalid/updates-features-{mask:x}"
        vector = make_patched_vector(parent, name, "12-2", chunks, outcome, note)
        yield replace(vector, recover=Recovery((), reject_ids=outcome.reject_ids))


def _make_damaged_vectors(parent: ValidStream) -> Iterable[Vector]:
    offsets = parent.layout.offsets
    for chunk_index in _FRAME_CHUNK_INDICES:
        yield from make_flip_vectors(parent, chunk_index, f"updates-flip-{chunk_index:02}")
        frames_before = count_frames(parent.stream.chunks[:chunk_index])
        yield make_loss_vector(
            parent, f"damaged/updates-lost-{chunk_index:02}", [chunk_index], frames_before, "a FRAM"
        )
        size = offsets[chunk_index + 1] - 12
        note = f"the stream is cut within the payload of chunk {chunk_index}"
        yield make_cut_vector(parent, size, f"damaged/updates-cut-{chunk_index:02}", note)
