"""Faults of records: wrong counts, changed sections, and sections copied from other frames."""

import random
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hostile.mutations import damage_bytes
from hostile.structured.fault import Fault, Stage
from hostile.structured.generator import RecordGenerator
from quarc_ref.format.arrays import UInt32
from quarc_ref.format.constants import POSITION_LIMIT
from quarc_ref.format.records import CanonicalChunk, FrameChunk, Section, SnapshotChunk

Record = CanonicalChunk | SnapshotChunk | FrameChunk
_MAX_U32 = (1 << 32) - 1
_ORIGINS = (0, POSITION_LIMIT, -POSITION_LIMIT - 1, 1 << 30, (1 << 31) - 1, -(1 << 31))


def _make_field_change(name: str, *values: int) -> Callable[[RecordGenerator, Record], Record]:
    """Return a function that sets a field to a given value, or changes it by 1, or doubles it."""

    def change(generator: RecordGenerator, record: Record) -> Record:
        current = getattr(record, name)
        neighbors = (max(0, current - 1), current + 1, 2 * current)
        return replace(record, **{name: generator.rng.choice((*values, *neighbors)) & _MAX_U32})

    return change


def _move_origin(generator: RecordGenerator, chunk: CanonicalChunk) -> CanonicalChunk:
    origin = list(chunk.origin)
    origin[generator.rng.randrange(3)] = generator.rng.choice(_ORIGINS)
    return replace(chunk, origin=(origin[0], origin[1], origin[2]))


def _change_axis_bits(generator: RecordGenerator, chunk: CanonicalChunk) -> CanonicalChunk:
    bits = generator.rng.choice((0, max(0, chunk.axis_bits - 1), chunk.axis_bits, 20))
    return replace(chunk, axis_bits=bits)


def _toggle_contexts(_generator: RecordGenerator, chunk: FrameChunk) -> FrameChunk:
    return replace(chunk, previous_contexts=not chunk.previous_contexts)


def _append_zero_word(_rng: random.Random, words: UInt32) -> UInt32:
    return np.append(words, _ZERO_WORD)


def _prepend_word(rng: random.Random, words: UInt32) -> UInt32:
    first_words = [rng.choice((0, 1, rng.getrandbits(32))) for _ in range(rng.choice((1, 1, 5)))]
    return np.concatenate([np.array(first_words, dtype=np.uint32), words])


def _drop_word(rng: random.Random, words: UInt32) -> UInt32:
    index = rng.randrange(words.size + 1)
    return np.delete(words, slice(index, index + 1))


def _flip_word_bit(rng: random.Random, words: UInt32) -> UInt32:
    changed = words.copy()
    if words.size:
        changed[rng.randrange(words.size)] ^= np.uint32(1 << rng.randrange(32))
    return changed


def _replace_words(rng: random.Random, _words: UInt32) -> UInt32:
    count = rng.choice((0, 1, 2, 8, 60))
    fill_word = rng.choice((None, None, _MAX_U32))
    words = [rng.getrandbits(32) if fill_word is None else fill_word for _ in range(count)]
    return np.array(words, dtype=np.uint32)


def _make_section_change(
    change: Callable[[random.Random, UInt32], UInt32],
) -> Callable[[RecordGenerator, Record], Record]:
    """Return a function that changes the words of a random section."""

    def change_section(generator: RecordGenerator, record: Record) -> Record:
        sections = _list_sections(record)
        index = generator.rng.randrange(len(sections))
        sections[index] = Section(change(generator.rng, sections[index].words))
        return _replace_sections(record, sections)

    return change_section


def _shuffle_sections(generator: RecordGenerator, record: Record) -> Record:
    sections = _list_sections(record)
    generator.rng.shuffle(sections)
    return _replace_sections(record, sections)


def _make_splice(donors: Sequence[Record]) -> Callable[[RecordGenerator, Record], Record]:
    """Return a function that copies sections from a frame of the same type in another stream."""

    def splice(generator: RecordGenerator, record: Record) -> Record:
        sections = _list_sections(record)
        same_type_donors = [
            _list_sections(donor) for donor in donors if type(donor) is type(record)
        ]
        donor_sections = generator.rng.choice(
            [candidate for candidate in same_type_donors if len(candidate) == len(sections)]
        )
        for index in generator.rng.sample(range(len(sections)), generator.rng.choice((1, 1, 2))):
            sections[index] = donor_sections[index]
        return _replace_sections(record, sections)

    return splice


def _make_frame_replacement(
    donors: Sequence[Record],
) -> Callable[[RecordGenerator, Record], Record]:
    """Return a function that replaces a frame with a frame of another stream."""

    def replace_frame(generator: RecordGenerator, record: Record) -> Record:
        donor = generator.rng.choice([donor for donor in donors if type(donor) is type(record)])
        ordinal_field = "phase" if isinstance(record, FrameChunk) else "frame"
        return replace(donor, **{ordinal_field: getattr(record, ordinal_field)})

    return replace_frame


def _change_state_crc(generator: RecordGenerator, payload: bytes) -> bytes:
    crc = generator.rng.choice((bytes(4), generator.rng.randbytes(4), b"\xff" * 4))
    return payload[:-4] + crc


def _resize_payload(generator: RecordGenerator, payload: bytes) -> bytes:
    extra = generator.rng.randbytes(generator.rng.choice((1, 4)))
    return generator.rng.choice((payload[:-1], payload[:4], b"", payload + extra))


def _write_wrong_number(generator: RecordGenerator, payload: bytes) -> bytes:
    """Write a wrong word count into the first section, or a wrong value into a one-byte field."""
    rng = generator.rng
    offset, size = rng.choice(((21, 4), (13, 4), (20, 1), (4, 1)))
    number = rng.choice((2, 21, 255, 1 << 20, 1 << 30, _MAX_U32)) % (1 << 8 * size)
    return payload[:offset] + number.to_bytes(size, "little") + payload[offset + size :]


def _damage_payload(generator: RecordGenerator, payload: bytes) -> bytes:
    return damage_bytes(generator.rng, payload, payload)[0]


def list_record_faults(donors: Sequence[Record]) -> list[Fault]:
    """Return the possible faults of records.

    Args:
        donors: Records of other streams, at least one of every type.
    """
    record_changes: dict[str, Callable[[RecordGenerator, Any], Any]] = {
        "an extra zero word at the end": _make_section_change(_append_zero_word),
        "extra words before the first word": _make_section_change(_prepend_word),
        "a missing word": _make_section_change(_drop_word),
        "a flipped bit in a word": _make_section_change(_flip_word_bit),
        "random words": _make_section_change(_replace_words),
        "sections in random order": _shuffle_sections,
        "sections of another stream": _make_splice(donors),
        "a frame of another stream": _make_frame_replacement(donors),
    }
    canonical_changes: dict[str, Callable[[RecordGenerator, Any], Any]] = {
        "gaussian_count": _make_field_change("gaussian_count", 0, 65537, _MAX_U32),
        "ordinal": _make_field_change("frame", 0, _MAX_U32),
        "origin": _move_origin,
        "axis_bits": _change_axis_bits,
    }
    frame_changes: dict[str, Callable[[RecordGenerator, Any], Any]] = {
        "phase": _make_field_change("phase", 0, _MAX_U32),
        "previous_contexts": _toggle_contexts,
        "death_count": _make_field_change("death_count", 1, 1 << 16, _MAX_U32),
        "birth_count": _make_field_change("birth_count", 1, 4097, 1 << 17, _MAX_U32),
    }
    snapshot_changes: dict[str, Callable[[RecordGenerator, Any], Any]] = {
        "newborn_count": _make_field_change("newborn_count", 0, 65537, _MAX_U32),
        "ordinal": _make_field_change("frame", 0, _MAX_U32),
        "ordinal of its canonical frame": _make_field_change("canonical", 0, _MAX_U32),
        "origin": _move_origin,
        "axis_bits": _change_axis_bits,
    }
    payload_changes: dict[str, Callable[[RecordGenerator, Any], Any]] = {
        "a wrong state CRC": _change_state_crc,
        "a wrong payload size": _resize_payload,
        "a wrong word count or flag": _write_wrong_number,
    }
    return [
        *(
            Fault(f"canonical: {name}", Stage.CANONICAL, record_changes[name])
            for name in record_changes
        ),
        *(Fault(f"frame: {name}", Stage.FRAME, record_changes[name]) for name in record_changes),
        *(
            Fault(f"snapshot: {name}", Stage.SNAPSHOT, record_changes[name], _SNAPSHOT_HEADER)
            for name in record_changes
        ),
        *(
            Fault(f"snapshot: {name}", Stage.SNAPSHOT, snapshot_changes[name], _SNAPSHOT_HEADER)
            for name in snapshot_changes
        ),
        *(
            Fault(f"canonical: {name}", Stage.CANONICAL, canonical_changes[name])
            for name in canonical_changes
        ),
        *(Fault(f"frame: {name}", Stage.FRAME, frame_changes[name]) for name in frame_changes),
        *(Fault(name, Stage.PAYLOAD, payload_changes[name]) for name in payload_changes),
        # At higher levels, a damaged count can request a million Gaussians, which takes too long.
        Fault("damaged bytes in a payload", Stage.PAYLOAD, _damage_payload, {"level": 10}),
    ]


def _list_sections(record: Record) -> list[Section]:
    if isinstance(record, CanonicalChunk):
        return list(record.sections)
    if isinstance(record, SnapshotChunk):
        return [record.survivors, *record.sections]
    updates = [] if record.updates is None else [record.updates]
    return [record.motion, record.births, *updates]


def _replace_sections(record: Record, sections: Sequence[Section]) -> Record:
    if isinstance(record, CanonicalChunk):
        return replace(record, sections=tuple(sections))
    if isinstance(record, SnapshotChunk):
        return replace(record, survivors=sections[0], sections=tuple(sections[1:]))
    motion, births, *updates = sections
    return replace(record, motion=motion, births=births, updates=updates[0] if updates else None)


_SNAPSHOT_HEADER = {"snapshots": True}
_ZERO_WORD = np.uint32(0)
