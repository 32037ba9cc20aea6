"""Records with wrong counts, and sections taken from elsewhere."""

import random
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hostile.mutations import damage_bytes
from hostile.structured.draws import Draws
from hostile.structured.hostility import Hostility, Stage
from quarc_ref.format.arrays import UInt32
from quarc_ref.format.constants import POSITION_LIMIT
from quarc_ref.format.records import CanonicalChunk, FrameChunk, Section, SnapshotChunk

Record = CanonicalChunk | SnapshotChunk | FrameChunk
_MAXIMUM = (1 << 32) - 1
_ORIGINS = (0, POSITION_LIMIT, -POSITION_LIMIT - 1, 1 << 30, (1 << 31) - 1, -(1 << 31))


def _set_field(name: str, *values: int) -> Callable[[Draws, Record], Record]:
    """Return a function that writes one of these numbers, or a similar one, into a field."""

    def change(draws: Draws, record: Record) -> Record:
        now = getattr(record, name)
        near = (max(0, now - 1), now + 1, 2 * now)
        return replace(record, **{name: draws.rng.choice((*values, *near)) & _MAXIMUM})

    return change


def _move_origin(draws: Draws, chunk: CanonicalChunk) -> CanonicalChunk:
    origin = list(chunk.origin)
    origin[draws.rng.randrange(3)] = draws.rng.choice(_ORIGINS)
    return replace(chunk, origin=(origin[0], origin[1], origin[2]))


def _narrow_box(draws: Draws, chunk: CanonicalChunk) -> CanonicalChunk:
    bits = draws.rng.choice((0, max(0, chunk.axis_bits - 1), chunk.axis_bits, 20))
    return replace(chunk, axis_bits=bits)


def _toggle_contexts(_draws: Draws, chunk: FrameChunk) -> FrameChunk:
    return replace(chunk, previous_contexts=not chunk.previous_contexts)


def _append_zero_word(_rng: random.Random, words: UInt32) -> UInt32:
    return np.append(words, _ZERO)


def _prepend_word(rng: random.Random, words: UInt32) -> UInt32:
    before = [rng.choice((0, 1, rng.getrandbits(32))) for _ in range(rng.choice((1, 1, 5)))]
    return np.concatenate([np.array(before, dtype=np.uint32), words])


def _drop_word(rng: random.Random, words: UInt32) -> UInt32:
    lost = rng.randrange(words.size + 1)
    return np.delete(words, slice(lost, lost + 1))


def _flip_word_bit(rng: random.Random, words: UInt32) -> UInt32:
    changed = words.copy()
    if words.size:
        changed[rng.randrange(words.size)] ^= np.uint32(1 << rng.randrange(32))
    return changed


def _draw_words(rng: random.Random, _words: UInt32) -> UInt32:
    count = rng.choice((0, 1, 2, 8, 60))
    fill = rng.choice((None, None, _MAXIMUM))
    drawn = [rng.getrandbits(32) if fill is None else fill for _ in range(count)]
    return np.array(drawn, dtype=np.uint32)


def _change_section(
    change: Callable[[random.Random, UInt32], UInt32],
) -> Callable[[Draws, Record], Record]:
    """Return a function that changes the words of a section."""

    def change_section(draws: Draws, record: Record) -> Record:
        sections = _sections(record)
        which = draws.rng.randrange(len(sections))
        sections[which] = Section(change(draws.rng, sections[which].words))
        return _with_sections(record, sections)

    return change_section


def _swap_sections(draws: Draws, record: Record) -> Record:
    sections = _sections(record)
    draws.rng.shuffle(sections)
    return _with_sections(record, sections)


def _splice(donors: Sequence[Record]) -> Callable[[Draws, Record], Record]:
    """Return a function that takes sections from a frame of the same kind in another stream."""

    def splice(draws: Draws, record: Record) -> Record:
        sections = _sections(record)
        same_type_donors = [_sections(donor) for donor in donors if type(donor) is type(record)]
        others = draws.rng.choice([each for each in same_type_donors if len(each) == len(sections)])
        for which in draws.rng.sample(range(len(sections)), draws.rng.choice((1, 1, 2))):
            sections[which] = others[which]
        return _with_sections(record, sections)

    return splice


def _replace(donors: Sequence[Record]) -> Callable[[Draws, Record], Record]:
    """Return a function that replaces a frame by one of another stream."""

    def take(draws: Draws, record: Record) -> Record:
        donor = draws.rng.choice([donor for donor in donors if type(donor) is type(record)])
        number = "phase" if isinstance(record, FrameChunk) else "frame"
        return replace(donor, **{number: getattr(record, number)})

    return take


def _change_state_crc(draws: Draws, payload: bytes) -> bytes:
    crc = draws.rng.choice((bytes(4), draws.rng.randbytes(4), b"\xff" * 4))
    return payload[:-4] + crc


def _resize(draws: Draws, payload: bytes) -> bytes:
    more = draws.rng.randbytes(draws.rng.choice((1, 4)))
    return draws.rng.choice((payload[:-1], payload[:4], b"", payload + more))


def _set_word_count(draws: Draws, payload: bytes) -> bytes:
    """State more words in the first section than it has, or other flags."""
    rng = draws.rng
    at, size = rng.choice(((21, 4), (13, 4), (20, 1), (4, 1)))
    number = rng.choice((2, 21, 255, 1 << 20, 1 << 30, _MAXIMUM)) % (1 << 8 * size)
    return payload[:at] + number.to_bytes(size, "little") + payload[at + size :]


def _damage(draws: Draws, payload: bytes) -> bytes:
    return damage_bytes(draws.rng, payload, payload)[0]


def list_hostile_records(donors: Sequence[Record]) -> list[Hostility]:
    """Return the possible faults of records.

    Args:
        donors: Records of other streams, some of every kind.
    """
    both: dict[str, Callable[[Draws, Any], Any]] = {
        "a word of 0 at the end": _change_section(_append_zero_word),
        "words before the first": _change_section(_prepend_word),
        "a word lost": _change_section(_drop_word),
        "a flipped bit of a word": _change_section(_flip_word_bit),
        "words drawn": _change_section(_draw_words),
        "sections swapped": _swap_sections,
        "sections of another stream": _splice(donors),
        "a frame of another stream": _replace(donors),
    }
    canonical: dict[str, Callable[[Draws, Any], Any]] = {
        "gaussian_count": _set_field("gaussian_count", 0, 65537, _MAXIMUM),
        "ordinal": _set_field("frame", 0, _MAXIMUM),
        "origin": _move_origin,
        "axis_bits": _narrow_box,
    }
    moved: dict[str, Callable[[Draws, Any], Any]] = {
        "phase": _set_field("phase", 0, _MAXIMUM),
        "previous_contexts": _toggle_contexts,
        "death_count": _set_field("death_count", 1, 1 << 16, _MAXIMUM),
        "birth_count": _set_field("birth_count", 1, 4097, 1 << 17, _MAXIMUM),
    }
    snapshot: dict[str, Callable[[Draws, Any], Any]] = {
        "newborn_count": _set_field("newborn_count", 0, 65537, _MAXIMUM),
        "ordinal": _set_field("frame", 0, _MAXIMUM),
        "the ordinal of its CANO": _set_field("canonical", 0, _MAXIMUM),
        "origin": _move_origin,
        "axis_bits": _narrow_box,
    }
    payload: dict[str, Callable[[Draws, Any], Any]] = {
        "the CRC of a state": _change_state_crc,
        "the size of a payload": _resize,
        "a number of words or a flag": _set_word_count,
    }
    return [
        *(Hostility(f"canonical: {name}", Stage.CANONICAL, both[name]) for name in both),
        *(Hostility(f"moved: {name}", Stage.FRAME, both[name]) for name in both),
        *(Hostility(f"snapshot: {name}", Stage.SNAPSHOT, both[name], _SNAPSHOTS) for name in both),
        *(
            Hostility(f"snapshot: {name}", Stage.SNAPSHOT, snapshot[name], _SNAPSHOTS)
            for name in snapshot
        ),
        *(Hostility(f"canonical: {name}", Stage.CANONICAL, canonical[name]) for name in canonical),
        *(Hostility(f"moved: {name}", Stage.FRAME, moved[name]) for name in moved),
        *(Hostility(name, Stage.PAYLOAD, payload[name]) for name in payload),
        # At other levels, damage can request a million Gaussians, which takes long.
        Hostility("bytes of a payload", Stage.PAYLOAD, _damage, {"level": 10}),
    ]


def _sections(record: Record) -> list[Section]:
    if isinstance(record, CanonicalChunk):
        return list(record.sections)
    if isinstance(record, SnapshotChunk):
        return [record.survivors, *record.sections]
    updates = [] if record.updates is None else [record.updates]
    return [record.motion, record.births, *updates]


def _with_sections(record: Record, sections: Sequence[Section]) -> Record:
    if isinstance(record, CanonicalChunk):
        return replace(record, sections=tuple(sections))
    if isinstance(record, SnapshotChunk):
        return replace(record, survivors=sections[0], sections=tuple(sections[1:]))
    motion, births, *updates = sections
    return replace(record, motion=motion, births=births, updates=updates[0] if updates else None)


_SNAPSHOTS = {"snapshots": True}
_ZERO = np.uint32(0)
