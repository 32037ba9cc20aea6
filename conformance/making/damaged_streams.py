"""damaged/: transmission errors, and the frames that can still be decoded.

Truncation, flipped bits, loss, repetition, reordering, and junk. Each vector has the results of
reading through the stream and of recovery (SPEC 11.4, 11.5).
"""

from collections.abc import Sequence

from making.fault_rows import (
    RECOVERY_CLAUSES,
    count_frames,
    damaged_by,
    resumed,
)
from making.lost_chunks import make_losses, make_orders
from making.payloads import MAGIC, pack_chunk, pack_chunk_header
from making.recovery_rules import make_rules
from making.scenes import pick
from making.streams import Piece, assemble
from making.vectors import Gap, Outcome, Recovery, Valid, Vector

_ANCILLARY = (1, 6, 11)
_FIRST_CANONICAL = 2


def make_damaged(parent: Valid) -> list[Vector]:
    """Return all vectors as patches of the journey, except the cuts at every byte."""
    return [
        *_cuts(parent),
        *_flips(parent),
        *make_losses(parent),
        *make_orders(parent),
        *_junk(parent),
        *make_rules(parent),
    ]


def make_cut(parent: Valid, size: int, name: str, note: str) -> Vector:
    """Return a stream that is cut after a number of bytes."""
    offsets, pieces = parent.layout.offsets, parent.stream.pieces
    data = parent.layout.data[:size]
    if size < offsets[1]:
        ids = ("truncated",) if size >= len(MAGIC) else ("truncated", "bad-magic")
        said, recovery = Outcome((), ids), Recovery((), refused=ids)
        return damaged_by(parent, name, "5.1-4", data, said, recovery, note)
    place = max(n for n, offset in enumerate(offsets) if offset <= size)
    frames = parent.frames[: count_frames(pieces[:place])]
    gap = Gap(offsets[place], size - offsets[place], ("truncated",), None)
    said, recovery = Outcome(frames, ("truncated",)), Recovery(frames, (gap,))
    return damaged_by(parent, name, f"5.1-4 {RECOVERY_CLAUSES}", data, said, recovery, note)


def _cuts(parent: Valid) -> list[Vector]:
    offsets = parent.layout.offsets
    sizes = {
        "nothing": (0, "no byte is left"),
        "magic": (8, "the magic alone"),
        "in-the-magic": (5, "half of the magic"),
        "in-head": (offsets[0] + 50, "within HEAD"),
        "after-head": (offsets[1], "after HEAD"),
        "after-cameras": (offsets[2], "after `came`"),
        "in-a-sync-word": (offsets[3] + 2, "within a sync word"),
        "in-a-header": (offsets[3] + 13, "within a chunk header"),
        "after-a-header": (offsets[4] + 20, "after a chunk header"),
        "in-a-payload": (offsets[5] + 100, "within the payload of CANO"),
        "before-a-payload-crc": (offsets[8] - 4, "before the CRC of a payload"),
        "in-a-payload-crc": (offsets[8] - 1, "within the CRC of a payload"),
        "after-a-frame": (offsets[8], "between two frames"),
        "in-an-ancillary": (offsets[11] + 30, "within an ancillary chunk"),
        "in-the-index": (offsets[13] + 40, "within INDX"),
        "before-tail": (offsets[14], "before TAIL"),
        "last-byte": (offsets[15] - 1, "the last byte is missing"),
    }
    return [
        make_cut(parent, size, f"damaged/cut-{name}", f"the stream is cut: {note}")
        for name, (size, note) in sizes.items()
    ]


def _flips(parent: Valid) -> list[Vector]:
    """A flipped bit in the header and in the payload of every chunk."""
    places = enumerate(parent.stream.pieces)
    return [
        vector
        for place, piece in places
        for vector in flip(parent, place, f"flip-{place:02}-{piece.kind.decode()}")
    ]


def flip(parent: Valid, place: int, name: str) -> list[Vector]:
    """Return streams with a flipped bit in the header, or in the payload, of a chunk."""
    vectors, kind = [], parent.stream.pieces[place].kind.decode()
    length = parent.layout.offsets[place + 1] - parent.layout.offsets[place]
    header, payload = pick(place, 1) % 20, 20 + pick(place, 2) % (length - 20)
    for part, at in (("header", header), ("payload", payload)):
        ids = ("payload-crc",) if at >= 20 else ("bad-sync",) if at < 4 else ("header-crc",)
        spoiled = parent.stream.replaced(place, flip_byte=at)
        note = f"a bit of byte {at} of chunk {place}, {kind}"
        vectors.append(_flipped(parent, place, spoiled, ids, f"damaged/{name}-{part}", note))
    return vectors


def _flipped(
    parent: Valid, place: int, pieces: list[Piece], ids: Sequence[str], name: str, note: str
) -> Vector:
    before = parent.frames[: count_frames(pieces[:place])]
    offsets = parent.layout.offsets
    data = assemble(pieces).data
    said = Outcome(before, tuple(ids))
    start, end = offsets[place], offsets[place + 1]
    if place == 0:
        recovery = Recovery((), refused=tuple(ids))
    elif place in _ANCILLARY and "payload-crc" in ids:
        recovery = Recovery(parent.frames, (Gap(start, end - start, tuple(ids), 0),))
    elif place == len(pieces) - 1:
        end = offsets[-1]
        gaps = (Gap(start, end - start, tuple(ids), None), Gap(end, 0, ("truncated",), None))
        recovery = Recovery(before, gaps)
    else:
        recovery = resumed(parent, pieces, place, ids)
        if place <= _FIRST_CANONICAL:
            recovery = Recovery(recovery.frames, (_unknown_gap(recovery.gaps[0]),))
    return damaged_by(parent, name, RECOVERY_CLAUSES, data, said, recovery, note)


def _unknown_gap(gap: Gap) -> Gap:
    """A gap before the first frame: the number of lost frames is unknown."""
    return Gap(gap.offset, gap.byte_count, gap.refused, None)


def _junk(parent: Valid) -> list[Vector]:
    data, offsets, frames = parent.layout.data, parent.layout.offsets, parent.frames
    at = offsets[7]  # FRAM of frame 4
    fake = pack_chunk_header(b"CANO", 40, 4096)
    old = data[offsets[2] : offsets[3]]
    low = pack_chunk(b"CANO", 60, (3).to_bytes(4, "little") + bytes(40))
    tail = data[offsets[14] :]
    pieces = {
        "bytes": (bytes(range(1, 60)), "bytes between two chunks"),
        "zeros": (bytes(512), "a block of zeros between two chunks"),
        "sync-words": (bytes.fromhex("9E5143F3") * 9, "sync words without chunks"),
        "header": (b"?" + fake, "a chunk header without its payload"),
        "old-canonical": (b"?" + old, "a CANO with an earlier number"),
        "old-ordinal": (b"?" + low, "a CANO with a later number and an earlier ordinal"),
        "tail": (b"?" + tail, "a TAIL that is not at the end"),
    }
    vectors = []
    for name, (junk, note) in pieces.items():
        changed = data[:at] + junk + data[at:]
        gap = Gap(at, len(junk) + offsets[9] - at, ("bad-sync",), 2)
        if name == "sync-words":
            gap = Gap(gap.offset, gap.byte_count, ("header-crc",), 2)
        said = Outcome(frames[:4], gap.refused)
        recovery = Recovery([*frames[:4], *frames[6:]], (gap,))
        vectors.append(
            damaged_by(
                parent, f"damaged/junk-{name}", RECOVERY_CLAUSES, changed, said, recovery, note
            )
        )
    cut = {
        "byte-lost": (
            data[: at + 30] + data[at + 31 :],
            at,
            offsets[9] - 1 - at,
            "a byte of a payload is missing",
        ),
        "byte-more": (
            data[: at + 30] + b"\0" + data[at + 30 :],
            at,
            offsets[9] + 1 - at,
            "a payload has an additional byte",
        ),
        "block-of-zeros": (
            data[: at + 30] + bytes(64) + data[at + 94 :],
            at,
            offsets[9] - at,
            "64 bytes are 0",
        ),
        "block-lost": (
            data[: at + 30] + data[offsets[8] + 50 :],
            at,
            offsets[9] - at - (offsets[8] + 50 - at - 30),
            "the bytes between two chunks are missing",
        ),
    }
    for name, (changed, start, size, note) in cut.items():
        said = Outcome(frames[:4], ("payload-crc",))
        recovery = Recovery([*frames[:4], *frames[6:]], (Gap(start, size, ("payload-crc",), 2),))
        vectors.append(
            damaged_by(parent, f"damaged/{name}", RECOVERY_CLAUSES, changed, said, recovery, note)
        )
    return vectors
