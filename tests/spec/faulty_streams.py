"""A stream with one fault for every reject id and every reaction of SPEC 3.3.

The stream has canonical frames 0, 3 and 6, and a `meta` before frame 4. A
fault is in that `meta`, in frame 3 or 4, or at either end.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from quarc_ref.decoder.reconstruct import begin_frame, motion_contexts
from quarc_ref.format import wire
from quarc_ref.format.coding.ans import encode_bits
from quarc_ref.format.coding.gaussian_planes import write_births
from quarc_ref.format.coding.motion_planes import write_motion
from quarc_ref.format.constants import (
    CODE_LIMIT,
    LEVELS,
    MAGIC,
    PROBABILITY_CODES,
    STATED_WEIGHT,
    WEIGHT_TOTAL,
)
from quarc_ref.format.container import build_chunk
from quarc_ref.format.records import SH_DC, FrameChunk, Section, SeekPoint, StreamHeader, Tail
from quarc_ref.streams.chunk_reader import split_chunks
from tests.small_streams import make_births, make_stream

HEADER = StreamHeader(
    rotation_components=4, rotation_unity=1, gaussians_per_anchor=4, seed=7, resample_interval=2
)
FRAME_COUNT = 9
_STREAM, STATES = make_stream(HEADER, 12, FRAME_COUNT, canonical_every=3)
_HEAD, _CANO, _META, _FRAM, _INDX, _TAIL = 0, 6, 7, 8, 13, 14  # frame 3, before 4, frame 4

Payloads = list[tuple[bytes, bytes]]
Change = Callable[[bytes], bytes]


class Case(NamedTuple):
    """A stream with a fault: its reject id, reaction, rejected frame and resume frame."""

    reject_id: str
    reaction: str
    data: bytes
    frame: int = 4
    resume_frame: int = 6


def _payloads() -> Payloads:
    payloads = [(chunk.kind, chunk.payload) for chunk in split_chunks(_STREAM)]
    payloads.insert(_META, (b"meta", wire.build_metadata({"title": "before frame 4"})))
    points, offset = [], len(MAGIC)
    for number, (kind, payload) in enumerate(payloads[:_INDX]):
        if kind == b"CANO":
            points.append(SeekPoint(offset, number, int.from_bytes(payload[:4], "little")))
        offset += len(build_chunk(kind, number, payload))
    tail = wire.build_tail(Tail(FRAME_COUNT, len(points), offset))
    return [*payloads[:_INDX], (b"INDX", wire.build_index(points)), (b"TAIL", tail)]


_PAYLOADS = _payloads()
_PIECES = [build_chunk(kind, number, data) for number, (kind, data) in enumerate(_PAYLOADS)]
VALID_STREAM = MAGIC + b"".join(_PIECES)


def _replace_chunk(index: int, *pieces: bytes) -> bytes:
    """Return the stream with a chunk replaced by other bytes."""
    return MAGIC + b"".join([*_PIECES[:index], *pieces, *_PIECES[index + 1 :]])


def _flip_bit(index: int, offset: int) -> bytes:
    piece = _PIECES[index]
    return _replace_chunk(index, piece[:offset] + bytes([piece[offset] ^ 1]) + piece[offset + 1 :])


def _change(index: int, change: Change) -> bytes:
    """Return the stream with a changed payload in one chunk, and a correct CRC."""
    kind, payload = _PAYLOADS[index]
    return _replace_chunk(index, build_chunk(kind, index, change(payload)))


def _set_byte(index: int, offset: int, value: int) -> bytes:
    return _change(index, lambda payload: payload[:offset] + bytes([value]) + payload[offset + 1 :])


def _append_byte(index: int) -> bytes:
    return _change(index, lambda payload: payload + b"\0")


def _flip_last_bit(index: int) -> bytes:
    return _change(index, lambda payload: payload[:-1] + bytes([payload[-1] ^ 1]))


def _frame(**fields: object) -> bytes:
    frame: FrameChunk = wire.parse_frame(_PAYLOADS[_FRAM][1])
    return _change(_FRAM, lambda _: wire.build_frame(replace(frame, **fields)))


def _canonical(**fields: object) -> bytes:
    chunk = wire.parse_canonical(_PAYLOADS[_CANO][1])
    return _change(_CANO, lambda _: wire.build_canonical(replace(chunk, **fields)))


def _section(*words: int) -> Section:
    return Section(np.array(words, dtype=np.uint32))


def _state_code(code: int) -> Section:
    """Return a section that ends after the stated code of its first context."""
    code_bits = np.unpackbits(np.array([code], dtype=np.uint8)).astype(np.bool_)
    is_stated = np.ones(1, dtype=np.bool_)
    words = encode_bits([(is_stated, STATED_WEIGHT), (code_bits, WEIGHT_TOTAL // 2)])
    return _section(*words)


def _cancel_identity() -> Section:
    """Return motion whose w cancels the identity at every Gaussian, so that the norm is 0."""
    begun_state = begin_frame(STATES[3], 0)
    symbols = [
        np.zeros((7, level.owners.size), np.int64) for level in begun_state.required_anchors.levels
    ]
    for level in symbols:
        level[3] = -1
    return write_motion(
        motion_contexts(begun_state, use_previous=True), symbols, begun_state.motion_counts
    )


def _make_two_births(parent: int = 0, component: int = 0, code: int = 0) -> bytes:
    """Return the stream with two births, whose green code is `code` and red is one more."""
    births = make_births(STATES[3], 2)
    births.parents[:] = parent
    births.newborn.rotations[1:] = component
    births.newborn.codes[SH_DC] = [[code + 1], [code], [code]]
    section = write_births(births, STATES[3].birth_counts)
    return _frame(motion=_section(), birth_count=2, births=section)


def cases() -> list[Case]:
    words = wire.parse_frame(_PAYLOADS[_FRAM][1]).motion.words.tolist()
    level_limits, at_end = LEVELS[HEADER.level], (FRAME_COUNT, FRAME_COUNT)
    far_position = HEADER.position_step * (1 << 23)
    return [
        Case("bad-magic", "refuse", b"x" + VALID_STREAM),
        Case(
            "truncated",
            "resume",
            VALID_STREAM[: VALID_STREAM.index(_PIECES[_FRAM]) + 30],
            4,
            FRAME_COUNT,
        ),
        Case("bad-sync", "resume", _flip_bit(_FRAM, 0)),
        Case("header-crc", "resume", _flip_bit(_FRAM, 9)),
        Case("payload-crc", "resume", _flip_bit(_FRAM, 20)),
        Case("payload-crc", "skip", _flip_bit(_META, 20)),
        Case("sequence", "resume", _replace_chunk(_FRAM)),
        Case("bad-chunk-type", "resume", _replace_chunk(_FRAM, build_chunk(b"FR1M", _FRAM, b""))),
        Case(
            "chunk-order",
            "resume",
            _replace_chunk(_FRAM, build_chunk(*_renumber_chunk(_HEAD, _FRAM))),
        ),
        Case("unknown-critical", "refuse", _replace_chunk(_FRAM, build_chunk(b"SNAP", _FRAM, b""))),
        Case("chunk-exceeds-level", "resume", _make_oversized_chunk(level_limits.chunk_bytes)),
        Case("trailing-data", "resume", _append_byte(_FRAM)),
        Case("trailing-data", "skip", _set_byte(_META, 0, 0)),
        Case("tail-mismatch", "resume", _set_byte(_TAIL, 0, FRAME_COUNT + 1), *at_end),
        Case("index-mismatch", "resume", _set_byte(_INDX, 4, 0), *at_end),
        Case("unsupported-version", "refuse", _set_byte(_HEAD, 0, 8)),
        Case("unsupported-feature", "refuse", _set_byte(_HEAD, 2, 1)),
        Case("field", "resume", _set_byte(_FRAM, 4, 2)),
        Case("field", "skip", _set_byte(_META, 0, 2)),
        Case("bad-probability", "resume", _frame(motion=_state_code(PROBABILITY_CODES))),
        Case("invalid-words", "resume", _frame(motion=_section(*words, 0))),
        Case("unconsumed-words", "resume", _frame(birth_count=0, births=_section(1))),
        Case("symbol-range", "resume", _canonical(axis_bits=0), 3),
        Case("count-exceeds-level", "resume", _frame(birth_count=level_limits.births + 1)),
        Case("count", "resume", _frame(death_count=STATES[3].scene.count)),
        Case("frame-order", "resume", _frame(phase=5)),
        Case("position-range", "resume", _canonical(origin=(far_position, 0, 0)), 3),
        Case("code-range", "resume", _make_two_births(code=CODE_LIMIT)),
        Case("rotation-range", "resume", _make_two_births(component=1 << HEADER.rotation_bits)),
        Case("degenerate-rotation", "resume", _frame(death_count=0, motion=_cancel_identity())),
        Case("parent-range", "resume", _make_two_births(parent=STATES[3].scene.count)),
        Case("state-crc", "resume", _flip_last_bit(_FRAM)),
    ]


def _renumber_chunk(index: int, sequence: int) -> tuple[bytes, int, bytes]:
    """Return the chunk at an index with another sequence number."""
    kind, payload = _PAYLOADS[index]
    return kind, sequence, payload


def _make_oversized_chunk(limit: int) -> bytes:
    return _replace_chunk(_FRAM, build_chunk(b"FRAM", _FRAM, bytes(limit + 1)))
