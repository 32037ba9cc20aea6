import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.decoder import compute_digest
from quarc_ref.format import container, wire
from quarc_ref.format.errors import BitstreamError, PayloadCrcError
from quarc_ref.format.records import StreamHeader, Tail
from quarc_ref.inspection.estimate import (
    estimate_births,
    estimate_gaussians,
    estimate_motion,
    estimate_updates,
)
from quarc_ref.inspection.inspect_stream import count_frames, inspect_stream
from quarc_ref.inspection.stream_summary import KINDS
from quarc_ref.streams.chunk_reader import split_chunks
from tests.small_streams import CAMERA, make_gaussians, make_stream, rebuild_stream

_DATA, _STATES = make_stream(gaussian_count=40, frame_count=5)
_SUMMARY = inspect_stream(_DATA)
_CHUNKS = [chunk for chunk in split_chunks(_DATA) if chunk.kind in (b"CANO", b"FRAM")]


def test_every_frame_is_described_as_decoded():
    assert [frame.frame for frame in _SUMMARY.frames] == [0, 1, 2, 3, 4]
    assert [frame.canonical for frame in _SUMMARY.frames] == [True, False, False, False, False]
    assert [frame.gaussians for frame in _SUMMARY.frames] == [s.scene.count for s in _STATES]
    assert [frame.sha256 for frame in _SUMMARY.frames] == [compute_digest(s.scene) for s in _STATES]


def test_births_and_deaths_explain_the_number_of_gaussians():
    assert [frame.births for frame in _SUMMARY.frames] == [0, 3, 0, 3, 0]
    for earlier, later in zip(_SUMMARY.frames, _SUMMARY.frames[1:], strict=False):
        assert later.gaussians == earlier.gaussians + later.births - later.deaths


def test_bytes_by_kind_are_those_of_the_sections():
    canonical = wire.parse_canonical(_CHUNKS[0].payload)
    frames = [wire.parse_frame(chunk.payload) for chunk in _CHUNKS[1:]]
    sizes = _SUMMARY.coded_bytes()

    assert sizes["canonical"] == sum(section.byte_count() for section in canonical.sections)
    assert sizes["motion"] == sum(frame.motion.byte_count() for frame in frames)
    assert sizes["births"] == sum(frame.births.byte_count() for frame in frames)


def test_kinds_and_overhead_add_up_to_the_stream():
    sizes = _SUMMARY.coded_bytes()

    assert sizes["total"] == len(_DATA)
    assert sizes["overhead"] == len(_DATA) - sum(sizes[kind] for kind in KINDS)
    assert sizes["overhead"] >= len(_DATA) - sum(chunk.byte_count() for chunk in _CHUNKS)


def test_kilobytes_per_frame_have_1024_bytes_and_include_framing():
    rates = _SUMMARY.kilobytes_per_frame()

    moved_bytes = sum(chunk.byte_count() for chunk in _CHUNKS[1:])
    assert rates["with_canonical"] == len(_DATA) / 5 / 1024
    assert rates["without_canonical"] == moved_bytes / 4 / 1024


def test_the_estimate_covers_the_symbols_of_all_frames():
    header, estimate = _SUMMARY.header, _SUMMARY.estimate_bytes()

    assert estimate["canonical"] == round(estimate_gaussians(make_gaussians(header, 40)))
    assert estimate["motion"] == round(sum(estimate_motion(s.symbols) for s in _STATES[1:]))
    births_estimates = [frame.estimate_bytes["births"] for frame in _SUMMARY.frames]
    assert births_estimates[1::2] == [estimate_births(state.births) for state in _STATES[1::2]]
    assert births_estimates[::2] == [0, 0, 0]
    assert min(births_estimates[1::2]) > 0


def test_cameras_metadata_and_counts_are_described():
    summary_json = _SUMMARY.as_json()

    assert _SUMMARY.cameras == (CAMERA,)
    assert summary_json["cameras"] == summary_json["held_out"] == ["cam00"]
    assert summary_json["metadata"] == {"capture": "made by hand"}
    assert summary_json["frames"] == 5
    assert summary_json["gaussians"] == _STATES[-1].scene.count
    assert summary_json["frames_per_second"] == 30
    assert summary_json["level"] == 1.0


def test_a_stream_of_one_frame_has_no_rate_for_later_frames():
    data, _ = make_stream(frame_count=1)
    summary = inspect_stream(data)

    assert summary.kilobytes_per_frame() == {
        "without_canonical": 0,
        "with_canonical": len(data) / 1024,
    }
    assert summary.anchor_count == 0


def test_progress_reports_every_frame():
    calls = []
    inspect_stream(_DATA, lambda *arguments: calls.append(arguments))

    assert calls == [("inspect", done, 5) for done in range(1, 6)]


@given(st.integers(0, len(_DATA)))
def test_the_frames_of_the_chunks_are_counted_without_decoding(size):
    ends = [chunk.offset + chunk.byte_count() for chunk in _CHUNKS]

    assert count_frames(_DATA[:size]) == sum(end <= size for end in ends)


def test_a_stream_that_does_not_decode_is_not_summarized():
    with pytest.raises(BitstreamError):
        inspect_stream(_DATA[:-1])


def test_an_unknown_chunk_is_not_read_into_memory():
    """The decoder's own limit applies only to the payloads that it decodes."""
    head, tail = wire.build_stream_header(StreamHeader(level=31)), wire.build_tail(Tail(0, 0, 0))
    payload = bytes((1 << 26) + 1)
    summary = inspect_stream(rebuild_stream([(b"HEAD", head), (b"note", payload), (b"TAIL", tail)]))

    assert [chunk.kind for chunk in summary.chunks] == ["HEAD", "note", "TAIL"]
    assert summary.chunks[1].byte_count == 24 + len(payload)


def test_an_unknown_chunk_with_a_wrong_crc_is_rejected():
    chunks = [(b"HEAD", wire.build_stream_header(StreamHeader())), (b"note", b"unknown")]

    with pytest.raises(PayloadCrcError):
        inspect_stream(rebuild_stream(chunks).replace(b"unknown", b"Unknown"))


def test_a_repeated_canonical_frame_is_canonical_too():
    payload = bytearray(_CHUNKS[0].payload)
    payload[:4] = (5).to_bytes(4, "little")
    data = _DATA[: _CHUNKS[-1].offset + _CHUNKS[-1].byte_count()]
    sequence = len(list(split_chunks(_DATA))) - 2
    data += container.build_chunk(b"CANO", sequence, bytes(payload))
    data += container.build_chunk(b"TAIL", sequence + 1, wire.build_tail(Tail(6, 2, 0)))

    summary = inspect_stream(data)

    assert [frame.canonical for frame in summary.frames] == [True, *[False] * 4, True]
    assert summary.anchor_count == _SUMMARY.anchor_count > summary.frames[-1].anchors
    moved_bytes = sum(chunk.byte_count() for chunk in _CHUNKS[1:])
    assert summary.kilobytes_per_frame()["without_canonical"] == moved_bytes / 4 / 1024
    assert summary.coded_bytes()["canonical"] == 2 * _SUMMARY.coded_bytes()["canonical"]


def test_updates_and_snapshots_are_described_as_decoded():
    header = StreamHeader(seed=3, updates=True, snapshots=True)
    data, states = make_stream(header, 40, frame_count=6, snapshot_every=3)
    frames = inspect_stream(data).frames
    chunks = [chunk for chunk in split_chunks(data) if chunk.kind in (b"CANO", b"SNAP", b"FRAM")]
    kinds = ["canonical", "moved", "moved", "snapshot", "moved", "moved"]

    assert [frame.kind for frame in frames] == kinds
    snapshot = wire.parse_snapshot(chunks[3].payload)
    assert frames[3].coded_bytes["snapshots"] == sum(
        section.byte_count() for section in (snapshot.survivors, *snapshot.sections)
    )
    for index in (1, 2, 4, 5):
        frame, updates = frames[index], states[index].updates
        chunk = wire.parse_frame(chunks[index].payload, updates=True)
        previous_count = frames[index - 1].gaussians
        deleted_count = int(updates.dies.sum())
        assert frame.gaussians == previous_count + frame.births - frame.deaths
        assert frame.deaths == chunk.death_count + deleted_count
        assert frame.updates == updates.count - deleted_count
        assert frame.coded_bytes["updates"] == chunk.updates.byte_count()
        assert frame.estimate_bytes["updates"] == estimate_updates(
            updates, previous_count - chunk.death_count
        )
    assert sum(int(states[index].updates.dies.sum()) for index in (1, 2, 4, 5)) > 0
