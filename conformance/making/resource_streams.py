"""resource/: small inputs that demand many resources, and the limits of decoders (SPEC 13)."""

import zlib
from dataclasses import replace

from making.payloads import MAGIC, Frame, pack_chunk, pack_chunk_header
from making.streams import Piece, Stream
from making.vectors import Gap, Outcome, Recovery, Splice, Valid, Vector, broken, valid


def make_resources(journey: Valid, full: Valid, unlimited: Valid) -> list[Vector]:
    """Return all vectors.

    Args:
        journey: `streams/journey`.
        full: A stream that begins with the maximum number of Gaussians of level 1.0, at one
            position.
        unlimited: A stream of level 31.
    """
    return [
        _crowded(full),
        *_lengths(journey, unlimited),
        *_counts(unlimited),
        *_searches(journey),
    ]


def _crowded(full: Valid) -> Vector:
    """65536 Gaussians at one position that do not move: each follows anchor 0."""
    stream = Stream(replace(full.stream.head, gaussians_per_anchor=16))
    stream.pieces.append(full.stream.pieces[1])
    state = full.stream.states[0]
    assert state is not None
    moved = replace(state, frame=1, phase=1)
    crc = zlib.crc32(moved.serialize(codes=False))
    stream.pieces.append(Piece(b"FRAM", Frame(1, 0, 0, 0, (), (), crc).pack()))
    stream.states += [state, moved]
    note = "65536 Gaussians at one position with 4096 anchors, in 259 bytes"
    return valid("resource/crowd", note, "1-1", stream.end()).vector


def _lengths(journey: Valid, unlimited: Valid) -> list[Vector]:
    greatest = 0xFFFFFFFF
    start = journey.layout.data[: journey.layout.offsets[7]]
    head = MAGIC + pack_chunk_header(b"HEAD", 0, greatest)
    end = unlimited.layout.offsets[2]
    cases = [
        (
            journey,
            "length",
            start + pack_chunk_header(b"FRAM", 7, greatest),
            journey.frames[:4],
            ("chunk-exceeds-level",),
            "the start of a FRAM of 2^32 - 1 bytes",
        ),
        (
            journey,
            "length-of-head",
            head,
            [],
            ("chunk-exceeds-level",),
            "the start of a HEAD of 2^32 - 1 bytes",
        ),
        (
            unlimited,
            "length-unlimited",
            unlimited.layout.data[:end] + pack_chunk_header(b"FRAM", 2, greatest) + bytes(99),
            unlimited.frames[:1],
            ("truncated",),
            "the first 99 bytes of a FRAM of 2^32 - 1 bytes at the unlimited level",
        ),
    ]
    return [
        broken(
            parent,
            f"resource/{name}",
            "5.2-6 5.2-7 13-1",
            data,
            Outcome(frames, ids, declined=parent is unlimited),
            note,
        )
        for parent, name, data, frames, ids, note in cases
    ]


def _counts(unlimited: Valid) -> list[Vector]:
    greatest = 0xFFFFFFFF
    stream = unlimited.stream
    empty = ((),) * 6
    gaussians = stream.frame_with(0, gaussian_count=greatest, sections=empty)
    births = stream.frame_with(1, birth_count=greatest, births=())
    some = stream.frame_with(0, gaussian_count=1 << 28, sections=empty)
    cases = [
        (
            "gaussians",
            gaussians,
            0,
            ("state-crc",),
            "2^32 - 1 Gaussians without words, at the unlimited level",
        ),
        (
            "gaussians-fewer",
            some,
            0,
            ("state-crc",),
            "2^28 Gaussians without words, at the unlimited level",
        ),
        (
            "births",
            births,
            1,
            ("state-crc", "count-exceeds-level"),
            "2^32 - 1 births without words, at the unlimited level",
        ),
    ]
    return [
        broken(
            unlimited,
            f"resource/{name}",
            "3.2-5 13-1",
            pieces,
            Outcome(unlimited.frames[:count], ids, declined=True),
            note,
        )
        for name, pieces, count, ids, note in cases
    ]


def _searches(journey: Valid) -> list[Vector]:
    """A mebibyte of junk, in which a search for a chunk must stay fast."""
    at, later = journey.layout.offsets[7], journey.layout.offsets[9]
    header = pack_chunk_header(b"CANO", 40, 1000)
    junk = {
        "search-sync-words": (bytes.fromhex("9E5143F3"), 1 << 18, "header-crc", "2^18 sync words"),
        "search-headers": (
            header,
            20000,
            "payload-crc sequence",
            "20000 headers without valid chunks",
        ),
        "search-chunks": (
            pack_chunk(b"CANO", 40, bytes(40)),
            16000,
            "sequence",
            "16000 CANO chunks with an earlier ordinal",
        ),
    }
    vectors = []
    for name, (piece, count, ids, note) in junk.items():
        data = journey.layout.data[:at] + piece * count + journey.layout.data[at:]
        refused = tuple(ids.split())
        gap = Gap(at, len(piece) * count + later - at, refused, 2)
        said = Outcome(journey.frames[:4], refused)
        vector = broken(journey, f"resource/{name}", "13-2", data, said, note)
        recovery = Recovery([*journey.frames[:4], *journey.frames[6:]], (gap,))
        splices = (Splice(at, 0, piece, count),)
        vectors.append(replace(vector, recover=recovery, splices=splices, stored=False))
    return vectors
