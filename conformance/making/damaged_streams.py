"""Makes the streams in damaged/, with transmission errors, and the frames that survive.

The errors are truncation, flipped bits, and lost, repeated, reordered or additional bytes. Each
vector has the expected output of decoding with and without recovery (SPEC 11.4, 11.5).
"""

from collections.abc import Sequence

from making.fault_rows import (
    RECOVERY_CLAUSES,
    TAIL_CHUNK_INDEX,
    count_frames,
    make_damaged_vector,
    make_recovery,
)
from making.lost_chunks import make_loss_vectors, make_order_vectors
from making.payloads import MAGIC, pack_chunk, pack_chunk_header
from making.recovery_rules import make_recovery_vectors
from making.scenes import hash_numbers
from making.streams import Chunk, assemble
from making.vectors import Gap, Outcome, Recovery, ValidStream, Vector

_ANCILLARY_CHUNK_INDICES = (1, 6, 11)
_FIRST_CANONICAL_CHUNK_INDEX = 2


def make_damaged_vectors(parent: ValidStream) -> list[Vector]:
    """Return the vectors in damaged/ that are patches of `streams/journey`."""
    return [
        *_make_cut_vectors(parent),
        *_make_all_flip_vectors(parent),
        *make_loss_vectors(parent),
        *make_order_vectors(parent),
        *_make_junk_vectors(parent),
        _make_junk_end_vector(parent),
        *make_recovery_vectors(parent),
    ]


def make_cut_vector(parent: ValidStream, size: int, name: str, note: str) -> Vector:
    """Return a vector with only the first `size` bytes of the parent."""
    offsets, chunks = parent.layout.offsets, parent.stream.chunks
    data = parent.layout.data[:size]
    if size < offsets[1]:
        reject_ids = ("truncated",) if size >= len(MAGIC) else ("truncated", "bad-magic")
        outcome, recovery = Outcome((), reject_ids), Recovery((), reject_ids=reject_ids)
        return make_damaged_vector(parent, name, "5.1-4", data, outcome, recovery, note)
    chunk_index = max(n for n, offset in enumerate(offsets) if offset <= size)
    frames = parent.frames[: count_frames(chunks[:chunk_index])]
    gap = Gap(offsets[chunk_index], size - offsets[chunk_index], ("truncated",), None)
    outcome, recovery = Outcome(frames, ("truncated",)), Recovery(frames, (gap,))
    return make_damaged_vector(
        parent, name, f"5.1-4 {RECOVERY_CLAUSES}", data, outcome, recovery, note
    )


def _make_cut_vectors(parent: ValidStream) -> list[Vector]:
    offsets = parent.layout.offsets
    sizes = {
        "nothing": (0, "before its first byte"),
        "magic": (8, "after the magic"),
        "in-the-magic": (5, "within the magic"),
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
        "last-byte": (offsets[15] - 1, "before its last byte"),
    }
    return [
        make_cut_vector(parent, size, f"damaged/cut-{name}", f"the stream is cut {note}")
        for name, (size, note) in sizes.items()
    ]


def _make_all_flip_vectors(parent: ValidStream) -> list[Vector]:
    """Return the two streams of `make_flip_vectors` for every chunk."""
    numbered_chunks = enumerate(parent.stream.chunks)
    return [
        vector
        for chunk_index, chunk in numbered_chunks
        for vector in make_flip_vectors(
            parent, chunk_index, f"flip-{chunk_index:02}-{chunk.kind.decode()}"
        )
    ]


def make_flip_vectors(parent: ValidStream, chunk_index: int, name: str) -> list[Vector]:
    """Return two streams with one flipped bit: in the header of a chunk, and in its payload."""
    vectors, kind = [], parent.stream.chunks[chunk_index].kind.decode()
    chunk_size = parent.layout.offsets[chunk_index + 1] - parent.layout.offsets[chunk_index]
    header_byte_index, payload_byte_index = (
        hash_numbers(chunk_index, 1) % 20,
        20 + hash_numbers(chunk_index, 2) % (chunk_size - 20),
    )
    for part, byte_index in (("header", header_byte_index), ("payload", payload_byte_index)):
        reject_ids = (
            ("payload-crc",)
            if byte_index >= 20
            else ("bad-sync",)
            if byte_index < 4
            else ("header-crc",)
        )
        chunks = parent.stream.replace_chunk(chunk_index, flipped_byte=byte_index)
        note = f"one bit of byte {byte_index} of chunk {chunk_index} ({kind}) is flipped"
        vectors.append(
            _make_flip_vector(
                parent, chunk_index, chunks, reject_ids, f"damaged/{name}-{part}", note
            )
        )
    return vectors


def _make_flip_vector(
    parent: ValidStream,
    chunk_index: int,
    chunks: list[Chunk],
    reject_ids: Sequence[str],
    name: str,
    note: str,
) -> Vector:
    frames_before = parent.frames[: count_frames(chunks[:chunk_index])]
    offsets = parent.layout.offsets
    data = assemble(chunks).data
    outcome = Outcome(frames_before, tuple(reject_ids))
    start, end = offsets[chunk_index], offsets[chunk_index + 1]
    if chunk_index == 0:
        recovery = Recovery((), reject_ids=tuple(reject_ids))
    elif chunk_index in _ANCILLARY_CHUNK_INDICES and "payload-crc" in reject_ids:
        recovery = Recovery(parent.frames, (Gap(start, end - start, tuple(reject_ids), 0),))
    elif chunk_index == len(chunks) - 1:
        end = offsets[-1]
        gaps = (Gap(start, end - start, tuple(reject_ids), None), Gap(end, 0, ("truncated",), None))
        recovery = Recovery(frames_before, gaps)
    else:
        recovery = make_recovery(parent, chunks, chunk_index, reject_ids)
        if chunk_index <= _FIRST_CANONICAL_CHUNK_INDEX:
            recovery = Recovery(recovery.frames, (_clear_lost_frames(recovery.gaps[0]),))
    return make_damaged_vector(parent, name, RECOVERY_CLAUSES, data, outcome, recovery, note)


def _clear_lost_frames(gap: Gap) -> Gap:
    """Return the gap with `frames_lost` set to None, as required before the first decoded frame."""
    return Gap(gap.offset, gap.byte_count, gap.reject_ids, None)


def _make_junk_vectors(parent: ValidStream) -> list[Vector]:
    data, offsets, frames = parent.layout.data, parent.layout.offsets, parent.frames
    offset = offsets[7]  # FRAM of frame 4
    lone_header = pack_chunk_header(b"CANO", 40, 4096)
    old_canonical = data[offsets[2] : offsets[3]]
    low_ordinal_canonical = pack_chunk(b"CANO", 60, (3).to_bytes(4, "little") + bytes(40))
    early_tail = data[offsets[14] :]
    junk_cases = {
        "bytes": (bytes(range(1, 60)), "additional bytes between two chunks"),
        "zeros": (bytes(512), "a block of zeros between two chunks"),
        "sync-words": (bytes.fromhex("9E5143F3") * 9, "sync words without chunks"),
        "header": (b"?" + lone_header, "a chunk header without its payload"),
        "old-canonical": (b"?" + old_canonical, "a CANO with an earlier sequence number"),
        "old-ordinal": (
            b"?" + low_ordinal_canonical,
            "a CANO with a later sequence number and an earlier ordinal",
        ),
        "tail": (b"?" + early_tail, "a TAIL that is not at the end"),
    }
    vectors = []
    for name, (junk, note) in junk_cases.items():
        changed_data = data[:offset] + junk + data[offset:]
        gap = Gap(offset, len(junk) + offsets[9] - offset, ("bad-sync",), 2)
        if name == "sync-words":
            gap = Gap(gap.offset, gap.byte_count, ("header-crc",), 2)
        outcome = Outcome(frames[:4], gap.reject_ids)
        recovery = Recovery([*frames[:4], *frames[6:]], (gap,))
        vectors.append(
            make_damaged_vector(
                parent,
                f"damaged/junk-{name}",
                RECOVERY_CLAUSES,
                changed_data,
                outcome,
                recovery,
                note,
            )
        )
    byte_changes = {
        "byte-lost": (
            data[: offset + 30] + data[offset + 31 :],
            offset,
            offsets[9] - 1 - offset,
            "a byte of a payload is missing",
        ),
        "byte-more": (
            data[: offset + 30] + b"\0" + data[offset + 30 :],
            offset,
            offsets[9] + 1 - offset,
            "a payload has an additional byte",
        ),
        "block-of-zeros": (
            data[: offset + 30] + bytes(64) + data[offset + 94 :],
            offset,
            offsets[9] - offset,
            "64 bytes are overwritten with 0",
        ),
        "block-lost": (
            data[: offset + 30] + data[offsets[8] + 50 :],
            offset,
            offsets[9] - offset - (offsets[8] + 50 - offset - 30),
            "all bytes from the middle of one chunk to the middle of the next are missing",
        ),
    }
    for name, (changed_data, start, size, note) in byte_changes.items():
        outcome = Outcome(frames[:4], ("payload-crc",))
        recovery = Recovery([*frames[:4], *frames[6:]], (Gap(start, size, ("payload-crc",), 2),))
        vectors.append(
            make_damaged_vector(
                parent, f"damaged/{name}", RECOVERY_CLAUSES, changed_data, outcome, recovery, note
            )
        )
    return vectors


def _make_junk_end_vector(parent: ValidStream) -> Vector:
    """Return a stream that ends with junk that is shorter than a chunk header (SPEC 11.4)."""
    start = parent.layout.offsets[TAIL_CHUNK_INDEX]
    data = parent.layout.data[:start] + bytes(range(1, 8))
    gaps = (
        Gap(start, len(data) - start, ("bad-sync",), None),
        Gap(len(data), 0, ("truncated",), None),
    )
    return make_damaged_vector(
        parent,
        "damaged/junk-end",
        f"5.1-4 {RECOVERY_CLAUSES}",
        data,
        Outcome(parent.frames, ("bad-sync", "truncated")),
        Recovery(parent.frames, gaps),
        "TAIL is replaced by junk that is shorter than a chunk header",
    )
