"""Mutates streams: a valid stream and a number determine a mutant.

Half of the mutations damage bytes, which the CRCs should detect. The other half act like an
attacker who can compute CRCs: they split the stream into chunks, change these, and assemble them
with correct numbers, lengths and CRCs, to reach the code behind the container.
"""

import random
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass

from quarc_ref.format.constants import MAGIC, SYNC
from quarc_ref.streams.chunk_reader import split_chunks

Chunks = list[tuple[bytes, bytes]]
"""Type and payload of each."""

# Numbers at or next to the limits of fields and counts.
_EDGES = (
    *(
        0,
        1,
        2,
        3,
        7,
        8,
        10,
        14,
        20,
        24,
        30,
        31,
        64,
        120,
        239,
        240,
        255,
        256,
        1 << 12,
        (1 << 12) + 1,
    ),
    *((1 << 16) - 1, 1 << 16, (1 << 16) + 1, 1 << 18, 1 << 20, 1 << 23, 1 << 24, 1 << 26, 1 << 30),
    *((1 << 31) - 1, 1 << 31, (1 << 32) - 2, (1 << 32) - 1),
)
_KINDS = (b"HEAD", b"CANO", b"FRAM", b"INDX", b"TAIL", b"came", b"meta", b"SNAP", b"aBcd", b"Q\0!z")
_MAX_BYTES = 1 << 16


@dataclass(frozen=True, slots=True)
class Mutant:
    """A stream with arbitrary contents.

    Attributes:
        data: Its bytes.
        recipe: Names of the seed and of the mutations.
        forged: Whether to correct its state CRCs as well; see `forging`.
    """

    data: bytes
    recipe: tuple[str, ...]
    forged: bool


class Mutator:
    """Generates mutants of seeds.

    Args:
        seeds: Valid streams by name. Shorter ones are chosen more often.
        series: Series of mutants.
    """

    def __init__(self, seeds: dict[str, bytes], series: int) -> None:
        self._seeds = seeds
        self._names = sorted(seeds)
        self._weights = [1 / len(seeds[name]) ** 2 for name in self._names]
        self._chunks = {name: split_stream(seeds[name]) for name in self._names}
        self._series = series

    def make(self, number: int) -> Mutant:
        """Return a mutant of the series."""
        rng = random.Random((self._series << 48) + number)
        name = rng.choices(self._names, self._weights)[0]
        if rng.random() < 0.5:
            other = self._seeds[rng.choice(self._names)]
            data, done = damage_bytes(rng, self._seeds[name], other)
            return Mutant(data[:_MAX_BYTES], (name, *done), forged=False)
        chunks, done = list(self._chunks[name]), []
        other_chunks = self._chunks[rng.choice(self._names)]
        for _ in range(rng.choice((1, 1, 1, 2, 3))):
            forgery = rng.choice(_FORGERIES)
            done.append(forgery.__name__.strip("_"))
            chunks = forgery(rng, chunks, other_chunks)
        return Mutant(join_chunks(chunks), (name, *done), forged=rng.random() < 0.3)


def damage_bytes(rng: random.Random, data: bytes, other: bytes) -> tuple[bytes, list[str]]:
    """Return bytes after one to four mutations, and the names of these.

    Args:
        rng: Draws them.
        data: What is mutated.
        other: Stream from which parts are taken.
    """
    done = []
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        damage = rng.choice(_DAMAGES)
        done.append(damage.__name__.strip("_"))
        data = damage(rng, data, other)
    return data, done


def split_stream(stream: bytes) -> Chunks:
    """Return the chunks of a stream.

    Raises:
        BitstreamError: It cannot be split into chunks.
    """
    return [(chunk.kind, chunk.payload) for chunk in split_chunks(stream)]


def join_chunks(chunks: Chunks) -> bytes:
    """Return a stream of arbitrary chunks with correct numbers, lengths and CRCs."""
    pieces = [MAGIC]
    for number, (kind, payload) in enumerate(chunks):
        header = SYNC + kind + struct.pack("<II", number, len(payload))
        crcs = struct.pack("<I", zlib.crc32(header)), struct.pack("<I", zlib.crc32(payload))
        pieces += [header, crcs[0], payload, crcs[1]]
    return b"".join(pieces)


def _flip(rng: random.Random, data: bytes, _other: bytes) -> bytes:
    if not data:
        return data
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8))):
        changed[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _write_number(rng: random.Random, data: bytes, _other: bytes) -> bytes:
    size = rng.choice((1, 2, 4, 4, 8))
    if len(data) < size:
        return data
    place = rng.randrange(len(data) - size + 1)
    now = int.from_bytes(data[place : place + size], "little")
    near = (now + rng.choice((-1, 1)), rng.getrandbits(8 * size), rng.choice(_EDGES))
    value = (rng.choice(near) % (1 << 8 * size)).to_bytes(size, "little")
    return data[:place] + value + data[place + size :]


def _truncate(rng: random.Random, data: bytes, _other: bytes) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _splice(rng: random.Random, data: bytes, other: bytes) -> bytes:
    return data[: rng.randrange(len(data) + 1)] + other[rng.randrange(len(other) + 1) :]


def _remove_bytes(rng: random.Random, data: bytes, _other: bytes) -> bytes:
    first, last = sorted((rng.randrange(len(data) + 1), rng.randrange(len(data) + 1)))
    return data[:first] + data[last:]


def _insert_bytes(rng: random.Random, data: bytes, other: bytes) -> bytes:
    place, start = rng.randrange(len(data) + 1), rng.randrange(len(other) + 1)
    junk = (rng.randbytes(rng.randrange(40)), other[start : start + rng.randrange(80)], SYNC)
    return data[:place] + rng.choice(junk) + data[place:]


def _swap_bytes(rng: random.Random, data: bytes, _other: bytes) -> bytes:
    first, middle, last = sorted(rng.randrange(len(data) + 1) for _ in range(3))
    return data[:first] + data[middle:last] + data[first:middle] + data[last:]


def _mutate_payload(damage: Callable[[random.Random, bytes, bytes], bytes]) -> "Forgery":
    """Return the mutation that damages one payload."""

    def forge(rng: random.Random, chunks: Chunks, other: Chunks) -> Chunks:
        if not chunks:
            return chunks
        place = rng.randrange(len(chunks))
        kind, payload = chunks[place]
        model = next((data for of, data in other if of == kind), payload)
        return [*chunks[:place], (kind, damage(rng, payload, model)), *chunks[place + 1 :]]

    forge.__name__ = f"{damage.__name__.strip('_')} in a payload"
    return forge


def _change_words(rng: random.Random, chunks: Chunks, _other: Chunks) -> Chunks:
    """Change the words of a section, and their number, if the chunk has sections."""
    places = [place for place, (kind, _) in enumerate(chunks) if kind in _FIRST_SECTION]
    if not places:
        return chunks
    place = rng.choice(places)
    kind, payload = chunks[place]
    start = _FIRST_SECTION[kind]
    for _ in range(rng.randrange(_SECTIONS[kind])):
        start += 4 + 4 * int.from_bytes(payload[start : start + 4], "little")
    count = int.from_bytes(payload[start : start + 4], "little")
    if start + 4 + 4 * count > len(payload):
        return chunks
    words = _draw_words(rng, payload[start + 4 : start + 4 + 4 * count])
    changed = payload[:start] + struct.pack("<I", len(words) // 4) + words
    return [
        *chunks[:place],
        (kind, changed + payload[start + 4 + 4 * count :]),
        *chunks[place + 1 :],
    ]


def _draw_words(rng: random.Random, words: bytes) -> bytes:
    made = rng.randbytes(4 * rng.choice((0, 1, 1, 2, 3, 8, 40)))
    choices = (made, words[:-4], words + made, b"\xff" * len(made), _flip(rng, words, b""), b"")
    return rng.choice(choices)


def _edit_count(rng: random.Random, chunks: Chunks, _other: Chunks) -> Chunks:
    """Write another number into a field that holds a size, number or count."""
    places = [place for place, (kind, _) in enumerate(chunks) if kind in _COUNTS]
    if not places:
        return chunks
    place = rng.choice(places)
    kind, payload = chunks[place]
    at, size = rng.choice(_COUNTS[kind])
    value = rng.choice((rng.choice(_EDGES), rng.getrandbits(rng.randrange(1, 33))))
    number = (value % (1 << 8 * size)).to_bytes(size, "little")
    return [
        *chunks[:place],
        (kind, payload[:at] + number + payload[at + size :]),
        *chunks[place + 1 :],
    ]


def _swap_chunks(rng: random.Random, chunks: Chunks, _other: Chunks) -> Chunks:
    changed = list(chunks)
    if len(chunks) > 1:
        first, second = rng.sample(range(len(chunks)), 2)
        changed[first], changed[second] = changed[second], changed[first]
    return changed


def _drop_chunk(rng: random.Random, chunks: Chunks, _other: Chunks) -> Chunks:
    lost = rng.randrange(len(chunks) + 1)
    return chunks[:lost] + chunks[lost + 1 :]


def _repeat_chunk(rng: random.Random, chunks: Chunks, _other: Chunks) -> Chunks:
    if not chunks:
        return chunks
    place = rng.randrange(len(chunks))
    return chunks[: place + 1] + rng.choice((1, 1, 3)) * [chunks[place]] + chunks[place + 1 :]


def _take_chunk(rng: random.Random, chunks: Chunks, other: Chunks) -> Chunks:
    place = rng.randrange(len(chunks) + 1)
    return [*chunks[:place], rng.choice(other), *chunks[place + rng.randrange(2) :]]


def _rename_chunk(rng: random.Random, chunks: Chunks, _other: Chunks) -> Chunks:
    if not chunks:
        return chunks
    place = rng.randrange(len(chunks))
    return [*chunks[:place], (rng.choice(_KINDS), chunks[place][1]), *chunks[place + 1 :]]


Forgery = Callable[[random.Random, Chunks, Chunks], Chunks]
_FIRST_SECTION = {b"CANO": 21, b"FRAM": 13}
_COUNTS = {  # offset and size of fields (SPEC 5.4, 5.5, 5.8, 5.9)
    b"CANO": ((0, 4), (4, 4), (4, 4), (4, 4), (8, 4), (12, 4), (20, 1), (21, 4)),
    b"FRAM": ((0, 4), (5, 4), (9, 4), (9, 4), (9, 4), (13, 4)),
    b"TAIL": ((0, 4), (4, 4), (8, 8)),
    b"INDX": ((0, 4), (4, 8), (12, 4), (16, 4)),
}
_SECTIONS = {b"CANO": 6, b"FRAM": 2}
_DAMAGES = (
    _flip,
    _flip,
    _write_number,
    _truncate,
    _splice,
    _remove_bytes,
    _insert_bytes,
    _swap_bytes,
)
_FORGERIES: tuple[Forgery, ...] = (
    *map(_mutate_payload, 3 * (_flip, _write_number)),
    *map(_mutate_payload, (_truncate, _splice, _remove_bytes, _insert_bytes)),
    *(8 * (_change_words,)),
    _edit_count,
    *(_swap_chunks, _drop_chunk, _repeat_chunk, _take_chunk, _rename_chunk),
)
