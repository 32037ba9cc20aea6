import io
import itertools
import random
import time
import zlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quarc_ref.decoder import compute_digest
from quarc_ref.format import container, wire
from quarc_ref.format.constants import CHUNK_HEADER_BYTES, LEVELS, MAGIC, SYNC
from quarc_ref.format.container import build_chunk
from quarc_ref.format.errors import BitstreamError, TruncatedError, UnknownCriticalError
from quarc_ref.format.records import Tail
from quarc_ref.streams import BytesSource, Follow, Gap, PipeSource, decode, recover, resync
from quarc_ref.streams.chunk_reader import split_chunks
from tests.small_streams import CountedSource, GrowingSource, make_stream, rebuild_stream
from tests.streams.edits import cut_bytes

_DATA, _STATES = make_stream(gaussian_count=12, frame_count=9, canonical_every=3)
_CHUNKS = list(split_chunks(_DATA))
_PIECES = [_DATA[c.offset : c.offset + c.byte_count()] for c in _CHUNKS]
_DIGESTS = [compute_digest(state.scene) for state in _STATES]
_FIRST = next(c.sequence for c in _CHUNKS if c.kind == container.CANO)
_KINDS = [c.kind for c in _CHUNKS]


def _recover(data, **options):
    """Return the ordinals of the recovered frames and the gaps, after checking the scenes."""
    frames, gaps = [], []
    for event in recover(data, **options):
        if isinstance(event, Gap):
            gaps.append(event)
        else:
            assert compute_digest(event) == _DIGESTS[event.frame]
            frames.append(event.frame)
    return frames, gaps


def _join_pieces(pieces):
    return MAGIC + b"".join(pieces)


def _frames_from_keyframe(frame):
    """Return the frames from the first canonical frame at or after `frame`."""
    return list(range(-(-frame // 3) * 3, 9))


def test_an_intact_stream_has_no_gaps():
    assert _recover(_DATA) == (list(range(9)), [])
    assert _recover(PipeSource(io.BytesIO(_DATA))) == (list(range(9)), [])


def test_a_truncated_stream_gives_its_complete_frames_and_an_error():
    data, _ = make_stream(gaussian_count=3, frame_count=3, canonical_every=2)
    chunks = list(split_chunks(data))
    ends = [c.offset + c.byte_count() for c in chunks if c.kind in (b"CANO", b"FRAM")]
    for size in range(len(data)):
        if size < chunks[1].offset:
            with pytest.raises(TruncatedError):
                list(recover(data[:size]))
            continue
        events = list(recover(data[:size]))
        gaps = [event for event in events if isinstance(event, Gap)]

        assert len(events) - len(gaps) == sum(end <= size for end in ends)
        assert [gap.reject_id for gap in gaps] == ["truncated"]
        assert gaps[0].offset + gaps[0].byte_count == size


def test_frames_lost_at_the_end_of_a_part_of_a_stream_are_counted():
    part = cut_bytes(_DATA, 3)
    chunks = list(split_chunks(part))
    last = [chunk for chunk in chunks if chunk.kind == container.FRAM][-1]
    frames, (gap,) = _recover(part.replace(part[last.offset :][: last.byte_count()], b""))

    assert (frames, gap.frames_lost) == ([3, 4, 5, 6, 7], 1)


@pytest.mark.parametrize("lost", range(1, len(_CHUNKS)))
def test_a_lost_chunk_costs_the_frames_up_to_the_next_canonical_frame(lost):
    pieces = _PIECES[:lost] + _PIECES[lost + 1 :]
    frame = max(0, lost - _FIRST)
    frames_before = list(range(min(frame, 9)))

    frames, gaps = _recover(_join_pieces(pieces))

    if _KINDS[lost] == container.TAIL:
        assert frames == list(range(9))
        assert [gap.reject_id for gap in gaps] == ["truncated"]
        return
    resume_frame = 0 if lost < _FIRST else -(-(frame + 1) // 3) * 3
    assert frames == frames_before + list(range(resume_frame, 9))
    assert [gap.reject_id for gap in gaps] == ["sequence"]
    frames_lost = None if lost <= _FIRST else min(resume_frame, 9) - len(frames_before)
    assert gaps[0].frames_lost == frames_lost


@pytest.mark.parametrize("damaged", range(_FIRST, _FIRST + 9))
@pytest.mark.parametrize(
    ("offset", "reject_id"), [(0, "bad-sync"), (9, "header-crc"), (21, "payload-crc")]
)
def test_damage_costs_the_frames_up_to_the_next_canonical_frame(damaged, offset, reject_id):
    data = bytearray(_DATA)
    data[_CHUNKS[damaged].offset + offset] ^= 1
    frame = damaged - _FIRST

    frames, gaps = _recover(bytes(data))

    assert frames == list(range(frame)) + _frames_from_keyframe(frame + 1)
    assert [gap.reject_id for gap in gaps] == [reject_id]
    assert gaps[0].offset == _CHUNKS[damaged].offset
    resume_index = _FIRST + -(-(frame + 1) // 3) * 3
    end = _CHUNKS[resume_index].offset if resume_index < _FIRST + 9 else _CHUNKS[-1].offset
    assert gaps[0].byte_count == end - gaps[0].offset
    frames_lost = min(resume_index - damaged, _FIRST + 9 - damaged)
    assert gaps[0].frames_lost == (frames_lost if frame else None)


@pytest.mark.parametrize("junk", [bytes(1 << 20), SYNC * (1 << 18), b"\x9e" * (1 << 20)])
@pytest.mark.parametrize("source", [BytesSource, lambda data: PipeSource(io.BytesIO(data))])
def test_a_megabyte_of_junk_between_chunks_is_skipped_and_reported(junk, source):
    offset = _CHUNKS[_FIRST + 4].offset

    frames, gaps = _recover(source(_DATA[:offset] + junk + _DATA[offset:]))

    assert frames == [0, 1, 2, 3, 6, 7, 8]
    skipped_bytes = _CHUNKS[_FIRST + 6].offset - offset
    (gap,) = gaps
    assert (gap.offset, gap.byte_count, gap.frames_lost) == (offset, len(junk) + skipped_bytes, 2)


@given(st.permutations(range(_FIRST, len(_CHUNKS))))
@settings(max_examples=25)
def test_reordered_chunks_never_give_a_wrong_or_an_earlier_frame(order):
    frames, gaps = _recover(_join_pieces(_PIECES[:_FIRST] + [_PIECES[i] for i in order]))

    assert frames == sorted(set(frames))
    assert bool(gaps) == (order != sorted(order))


def test_swapped_chunks_cost_the_frames_up_to_the_next_canonical_frame():
    order = [*range(_FIRST + 1), _FIRST + 2, _FIRST + 1, *range(_FIRST + 3, len(_CHUNKS))]

    frames, gaps = _recover(_join_pieces([_PIECES[i] for i in order]))

    assert frames == [0, 3, 4, 5, 6, 7, 8]
    assert [(gap.reject_id, gap.frames_lost) for gap in gaps] == [("sequence", 2)]


def test_decoding_resumes_at_a_canonical_chunk_after_a_lost_chunk():
    pieces = _PIECES[: _FIRST + 2] + _PIECES[_FIRST + 3 :]

    frames, gaps = _recover(_join_pieces(pieces))

    assert frames == [0, 1, 3, 4, 5, 6, 7, 8]
    assert [(gap.byte_count, gap.frames_lost) for gap in gaps] == [(0, 1)]


def _change_payloads(change):
    """Return the stream with changed payloads in some chunks, and correct CRCs."""
    return rebuild_stream(
        (c.kind, change.get(c.sequence, lambda payload: payload)(c.payload)) for c in _CHUNKS
    )


def test_a_rejected_payload_is_a_gap_as_well():
    data = _change_payloads({_FIRST + 3: lambda payload: payload[:-1] + bytes([payload[-1] ^ 1])})

    frames, gaps = _recover(data)

    assert frames == [0, 1, 2, 6, 7, 8]
    assert [(gap.reject_id, gap.frames_lost) for gap in gaps] == [("state-crc", 3)]
    assert gaps[0].offset == _CHUNKS[_FIRST + 3].offset


def test_frames_between_two_rejected_canonical_chunks_are_counted_once():
    def corrupt_crc(payload):
        return payload[:-1] + bytes([payload[-1] ^ 1])

    frames, gaps = _recover(
        _change_payloads(
            {_FIRST + 1: corrupt_crc, _FIRST + 3: corrupt_crc, _FIRST + 6: corrupt_crc}
        )
    )

    assert frames == [0]
    assert [gap.frames_lost for gap in gaps] == [2, 3, 3]


@pytest.mark.parametrize("sequence", [1, 2])
def test_a_damaged_ancillary_chunk_costs_no_frame(sequence):
    damaged = bytearray(_DATA)
    damaged[_CHUNKS[sequence].offset + 20] ^= 1
    corrupted = _change_payloads({sequence: lambda payload: payload[:-1] + b"\xff"})

    for data, reject_id in ((bytes(damaged), "payload-crc"), (corrupted, "field")):
        frames, gaps = _recover(data)
        assert frames == list(range(9))
        assert [(gap.reject_id, gap.frames_lost) for gap in gaps] == [(reject_id, 0)]


def test_a_damaged_private_chunk_costs_no_frame():
    private_chunk = build_chunk(b"oDds", _FIRST, b"whatever")
    pieces = [*_PIECES[:_FIRST], private_chunk[:-1] + bytes([private_chunk[-1] ^ 1])]
    pieces += [build_chunk(c.kind, c.sequence + 1, c.payload) for c in _CHUNKS[_FIRST:-2]]

    frames, gaps = _recover(_join_pieces(pieces))

    assert frames == list(range(9))
    assert [gap.reject_id for gap in gaps] == ["payload-crc", "truncated"]


def test_a_wrong_index_loses_no_frame():
    frames, gaps = _recover(
        _change_payloads({len(_CHUNKS) - 2: lambda payload: payload[:4] + bytes(48)})
    )

    assert frames == list(range(9))
    assert [(gap.reject_id, gap.frames_lost) for gap in gaps] == [("index-mismatch", 0)]


@pytest.mark.parametrize(("frame_count", "lost"), [(12, 4), (3, None)])
def test_the_frame_count_of_the_tail_is_used_after_damage_if_plausible(frame_count, lost):
    def change_frame_count(_):
        return wire.build_tail(Tail(frame_count, 3, 0))

    data = bytearray(_change_payloads({len(_CHUNKS) - 1: change_frame_count}))
    data[_CHUNKS[_FIRST + 8].offset + 20] ^= 1

    frames, gaps = _recover(bytes(data))

    assert frames == list(range(8))
    assert [(gap.reject_id, gap.frames_lost) for gap in gaps] == [("payload-crc", lost)]


def test_the_tail_is_ignored_if_the_first_frame_is_lost():
    pieces = [*_PIECES[:_FIRST], *_PIECES[_FIRST + 1 : _FIRST + 8], *_PIECES[_FIRST + 9 :]]

    frames, gaps = _recover(_join_pieces(pieces))

    assert frames == [3, 4, 5, 6, 7]
    assert [gap.frames_lost for gap in gaps] == [None, None]


def _forge_header(kind, sequence, length):
    """Return a chunk header with a correct CRC, whose payload is missing."""
    header = build_chunk(kind, sequence, bytes(0))[:12] + length.to_bytes(4, "little")
    return header + zlib.crc32(header).to_bytes(4, "little")


def _forge_nested_chunks(kind, count, canonical):
    """Yield pairs of a small CANO and a header whose payload extends to the end of all pairs."""
    pair_bytes = len(build_chunk(b"CANO", 0, canonical)) + CHUNK_HEADER_BYTES
    for pair in range(count):
        length = (count - pair - 1) * pair_bytes + 1000
        yield build_chunk(b"CANO", _FIRST + 2 * pair, pair.to_bytes(4, "little") + canonical[4:])
        yield _forge_header(kind, _FIRST + 2 * pair + 1, length)


@pytest.mark.parametrize("kind", [b"CANO", b"FRAM"])
@pytest.mark.parametrize("canonical", [bytes(2000), _CHUNKS[_FIRST].payload])
def test_failed_crc_checks_have_one_budget_for_the_whole_stream(kind, canonical):
    chunks = _forge_nested_chunks(kind, 1024, canonical)
    source = CountedSource(_join_pieces([*_PIECES[:_FIRST], *chunks, bytes(2100)]))
    limit = LEVELS[10].chunk_bytes

    assert Gap in {type(event) for event in recover(source)}
    assert source.byte_count() < 16 * (source.size() + limit) + 8 * source.size() + limit


@pytest.mark.parametrize("source", [BytesSource, lambda data: PipeSource(io.BytesIO(data))])
def test_bytes_after_the_tail_are_a_gap(source):
    frames, gaps = _recover(source(_DATA + b"more"))

    assert frames == list(range(9))
    (gap,) = gaps
    assert (gap.reject_id, gap.offset, gap.frames_lost) == ("trailing-data", len(_DATA), None)
    assert gap.byte_count == (4 if source is BytesSource else None)


def test_damage_up_to_the_end_of_a_truncated_stream_is_reported_as_both():
    damaged = bytearray(_DATA[: _CHUNKS[-2].offset])
    damaged[_CHUNKS[_FIRST + 7].offset + 21] ^= 1

    frames, gaps = _recover(bytes(damaged))

    assert frames == list(range(7))
    assert [gap.reject_id for gap in gaps] == ["payload-crc", "truncated"]
    assert [gap.offset + gap.byte_count for gap in gaps] == [len(damaged)] * 2


def test_bytes_lost_within_a_chunk_do_not_hide_the_next():
    offset = _CHUNKS[_FIRST + 5].offset + 30

    frames, _ = _recover(_DATA[:offset] + _DATA[offset + 5 :])

    assert frames == [0, 1, 2, 3, 4, 6, 7, 8]


def test_an_unrecoverable_stream_is_rejected():
    with pytest.raises(BitstreamError):
        _recover(_DATA[:9] + b"\0" + _DATA[10:])
    with pytest.raises(BitstreamError):
        _recover(_join_pieces(_PIECES[1:]))
    with pytest.raises(UnknownCriticalError):
        _recover(_join_pieces(_PIECES[:1]) + build_chunk(b"SNAP", 1, b""))


def test_a_stream_that_stops_growing_times_out():
    frames, gaps = _recover(_DATA[:-50], follow=Follow(interval=0.001, patience=0.01))

    assert frames == list(range(9))
    assert [gap.reject_id for gap in gaps] == ["truncated"]


def test_waiting_for_a_keyframe_does_not_spend_the_search_budget(monkeypatch):
    monkeypatch.setattr(resync, "_MAX_BUDGETED_PAYLOAD_BYTES", 0)  # as if the chunks were large
    damaged = bytearray(_DATA)
    damaged[_CHUNKS[_FIRST].offset + 21] ^= 1
    source = GrowingSource(bytes(damaged), _CHUNKS[_FIRST + 1].offset)
    monkeypatch.setattr(time, "sleep", source.wait)

    frames, gaps = _recover(source, follow=Follow())

    assert frames == list(range(3, 9))
    assert [gap.reject_id for gap in gaps] == ["payload-crc"]


def test_every_damaged_byte_is_in_one_gap():
    rng = random.Random(5)
    for _ in range(40):
        data = bytearray(_DATA)
        damaged_offsets = rng.sample(range(_CHUNKS[1].offset, len(data)), 3)
        for offset in damaged_offsets:
            data[offset] ^= 1 << rng.randrange(8)
        frames, gaps = _recover(bytes(data))

        gap_ranges = [range(gap.offset, gap.offset + gap.byte_count) for gap in gaps]
        for offset in damaged_offsets:
            assert sum(offset in gap_range for gap_range in gap_ranges) == 1
        assert frames == sorted(set(frames))
        for earlier, later in itertools.pairwise(gaps):
            assert earlier.offset + earlier.byte_count <= later.offset
        decoded_frames = [scene.frame for scene in _decode_until_fault(bytes(data))]
        assert frames[: len(decoded_frames)] == decoded_frames


def _decode_until_fault(data):
    try:
        yield from decode(data)
    except BitstreamError:
        return
