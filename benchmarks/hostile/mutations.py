"""Mutates streams; each mutant is determined by the seeds, a series and a number.

Half of the mutants have damaged bytes, which the CRCs should detect. The other half imitates an
attacker who can compute CRCs: chunks are changed, and are written with correct sequence numbers,
lengths and CRCs. The changes therefore reach the code that decodes payloads.
"""

import random
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass

from quarc_ref.format.constants import MAGIC, SYNC
from quarc_ref.streams.chunk_reader import split_chunks

Chunks = list[tuple[bytes, bytes]]
"""Type and payload of each chunk of a stream."""

# Numbers at or close to the limits of fields and counts.
_EDGE_NUMBERS = (
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
_CHUNK_TYPES = (
    b"HEAD",
    b"CANO",
    b"FRAM",
    b"INDX",
    b"TAIL",
    b"came",
    b"meta",
    b"SNAP",
    b"aBcd",
    b"Q\0!z",
)
_MAX_MUTANT_BYTES = 1 << 16


@dataclass(frozen=True, slots=True)
class Mutant:
    """A stream that may be malformed.

    Attributes:
        data: Bytes of the stream.
        recipe: Name of the seed, and names of the mutations in their order.
        has_forged_crcs: Whether to correct the state CRCs before decoding; see `forging`.
    """

    data: bytes
    recipe: tuple[str, ...]
    has_forged_crcs: bool


class Mutator:
    """Generates mutants of seeds.

    Args:
        seeds: Valid streams by name; short streams are chosen more often.
        series: Number of the series of mutants.
    """

    def __init__(self, seeds: dict[str, bytes], series: int) -> None:
        self._seeds = seeds
        self._names = sorted(seeds)
        self._weights = [1 / len(seeds[name]) ** 2 for name in self._names]
        self._chunks = {name: split_stream(seeds[name]) for name in self._names}
        self._series = series

    def make(self, number: int) -> Mutant:
        """Return the mutant with the given number in the series."""
        rng = random.Random((self._series << 48) + number)
        name = rng.choices(self._names, self._weights)[0]
        if rng.random() < 0.5:
            donor = self._seeds[rng.choice(self._names)]
            data, mutation_names = damage_bytes(rng, self._seeds[name], donor)
            return Mutant(data[:_MAX_MUTANT_BYTES], (name, *mutation_names), has_forged_crcs=False)
        chunks, mutation_names = list(self._chunks[name]), []
        donor_chunks = self._chunks[rng.choice(self._names)]
        for _ in range(rng.choice((1, 1, 1, 2, 3))):
            forgery = rng.choice(_FORGERIES)
            mutation_names.append(forgery.__name__.strip("_"))
            chunks = forgery(rng, chunks, donor_chunks)
        return Mutant(
            join_chunks(chunks), (name, *mutation_names), has_forged_crcs=rng.random() < 0.3
        )


def damage_bytes(rng: random.Random, data: bytes, donor: bytes) -> tuple[bytes, list[str]]:
    """Apply one to four mutations to `data`; return the result, and the names of the mutations.

    Args:
        rng: Source of random numbers.
        data: Bytes to mutate.
        donor: Bytes from which some mutations copy parts, such as another stream.
    """
    mutation_names = []
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        damage = rng.choice(_DAMAGES)
        mutation_names.append(damage.__name__.strip("_"))
        data = damage(rng, data, donor)
    return data, mutation_names


def split_stream(stream: bytes) -> Chunks:
    """Return the chunks of a stream.

    Raises:
        BitstreamError: The stream cannot be split into chunks.
    """
    return [(chunk.kind, chunk.payload) for chunk in split_chunks(stream)]


def join_chunks(chunks: Chunks) -> bytes:
    """Return a stream of these chunks, with correct sequence numbers, lengths and CRCs."""
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
    offset = rng.randrange(len(data) - size + 1)
    current = int.from_bytes(data[offset : offset + size], "little")
    candidates = (
        current + rng.choice((-1, 1)),
        rng.getrandbits(8 * size),
        rng.choice(_EDGE_NUMBERS),
    )
    value = (rng.choice(candidates) % (1 << 8 * size)).to_bytes(size, "little")
    return data[:offset] + value + data[offset + size :]


def _truncate(rng: random.Random, data: bytes, _other: bytes) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _splice(rng: random.Random, data: bytes, donor: bytes) -> bytes:
    return data[: rng.randrange(len(data) + 1)] + donor[rng.randrange(len(donor) + 1) :]


def _remove_bytes(rng: random.Random, data: bytes, _other: bytes) -> bytes:
    first, last = sorted((rng.randrange(len(data) + 1), rng.randrange(len(data) + 1)))
    return data[:first] + data[last:]


def _insert_bytes(rng: random.Random, data: bytes, donor: bytes) -> bytes:
    offset, start = rng.randrange(len(data) + 1), rng.randrange(len(donor) + 1)
    insertions = (rng.randbytes(rng.randrange(40)), donor[start : start + rng.randrange(80)], SYNC)
    return data[:offset] + rng.choice(insertions) + data[offset:]


def _swap_bytes(rng: random.Random, data: bytes, _other: bytes) -> bytes:
    first, middle, last = sorted(rng.randrange(len(data) + 1) for _ in range(3))
    return data[:first] + data[middle:last] + data[first:middle] + data[last:]


def _make_payload_mutation(damage: Callable[[random.Random, bytes, bytes], bytes]) -> "Forgery":
    """Return a mutation that applies `damage` to the payload of a random chunk."""

    def forge(rng: random.Random, chunks: Chunks, donor_chunks: Chunks) -> Chunks:
        if not chunks:
            return chunks
        index = rng.randrange(len(chunks))
        kind, payload = chunks[index]
        donor_payload = next(
            (data for donor_kind, data in donor_chunks if donor_kind == kind), payload
        )
        return [*chunks[:index], (kind, damage(rng, payload, donor_payload)), *chunks[index + 1 :]]

    forge.__name__ = f"{damage.__name__.strip('_')} in a payload"
    return forge


def _change_words(rng: random.Random, chunks: Chunks, _other: Chunks) -> Chunks:
    """Replace the words of a section in a chunk; the number of words may change."""
    indices = [index for index, (kind, _) in enumerate(chunks) if kind in _FIRST_SECTION_OFFSETS]
    if not indices:
        return chunks
    index = rng.choice(indices)
    kind, payload = chunks[index]
    start = _FIRST_SECTION_OFFSETS[kind]
    for _ in range(rng.randrange(_SECTION_COUNTS[kind])):
        start += 4 + 4 * int.from_bytes(payload[start : start + 4], "little")
    count = int.from_bytes(payload[start : start + 4], "little")
    if start + 4 + 4 * count > len(payload):
        return chunks
    words = _choose_words(rng, payload[start + 4 : start + 4 + 4 * count])
    changed = payload[:start] + struct.pack("<I", len(words) // 4) + words
    return [
        *chunks[:index],
        (kind, changed + payload[start + 4 + 4 * count :]),
        *chunks[index + 1 :],
    ]


def _choose_words(rng: random.Random, words: bytes) -> bytes:
    random_words = rng.randbytes(4 * rng.choice((0, 1, 1, 2, 3, 8, 40)))
    choices = (
        random_words,
        words[:-4],
        words + random_words,
        b"\xff" * len(random_words),
        _flip(rng, words, b""),
        b"",
    )
    return rng.choice(choices)


def _change_count(rng: random.Random, chunks: Chunks, _other: Chunks) -> Chunks:
    """Write a random number into a field that holds a size, an ordinal or a count."""
    indices = [index for index, (kind, _) in enumerate(chunks) if kind in _COUNT_FIELDS]
    if not indices:
        return chunks
    index = rng.choice(indices)
    kind, payload = chunks[index]
    offset, size = rng.choice(_COUNT_FIELDS[kind])
    value = rng.choice((rng.choice(_EDGE_NUMBERS), rng.getrandbits(rng.randrange(1, 33))))
    number = (value % (1 << 8 * size)).to_bytes(size, "little")
    return [
        *chunks[:index],
        (kind, payload[:offset] + number + payload[offset + size :]),
        *chunks[index + 1 :],
    ]


def _swap_chunks(rng: random.Random, chunks: Chunks, _other: Chunks) -> Chunks:
    changed = list(chunks)
    if len(chunks) > 1:
        first, second = rng.sample(range(len(chunks)), 2)
        changed[first], changed[second] = changed[second], changed[first]
    return changed


def _drop_chunk(rng: random.Random, chunks: Chunks, _other: Chunks) -> Chunks:
    index = rng.randrange(len(chunks) + 1)
    return chunks[:index] + chunks[index + 1 :]


def _repeat_chunk(rng: random.Random, chunks: Chunks, _other: Chunks) -> Chunks:
    if not chunks:
        return chunks
    index = rng.randrange(len(chunks))
    return chunks[: index + 1] + rng.choice((1, 1, 3)) * [chunks[index]] + chunks[index + 1 :]


def _copy_donor_chunk(rng: random.Random, chunks: Chunks, donor_chunks: Chunks) -> Chunks:
    index = rng.randrange(len(chunks) + 1)
    return [*chunks[:index], rng.choice(donor_chunks), *chunks[index + rng.randrange(2) :]]


def _change_chunk_type(rng: random.Random, chunks: Chunks, _other: Chunks) -> Chunks:
    if not chunks:
        return chunks
    index = rng.randrange(len(chunks))
    return [*chunks[:index], (rng.choice(_CHUNK_TYPES), chunks[index][1]), *chunks[index + 1 :]]


Forgery = Callable[[random.Random, Chunks, Chunks], Chunks]
_FIRST_SECTION_OFFSETS = {b"CANO": 21, b"FRAM": 13}
_COUNT_FIELDS = {  # offset and size of fields (SPEC 5.4, 5.5, 5.8, 5.9)
    b"CANO": ((0, 4), (4, 4), (4, 4), (4, 4), (8, 4), (12, 4), (20, 1), (21, 4)),
    b"FRAM": ((0, 4), (5, 4), (9, 4), (9, 4), (9, 4), (13, 4)),
    b"TAIL": ((0, 4), (4, 4), (8, 8)),
    b"INDX": ((0, 4), (4, 8), (12, 4), (16, 4)),
}
_SECTION_COUNTS = {b"CANO": 6, b"FRAM": 2}
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
    *map(_make_payload_mutation, 3 * (_flip, _write_number)),
    *map(_make_payload_mutation, (_truncate, _splice, _remove_bytes, _insert_bytes)),
    *(8 * (_change_words,)),
    _change_count,
    *(_swap_chunks, _drop_chunk, _repeat_chunk, _copy_donor_chunk, _change_chunk_type),
)
