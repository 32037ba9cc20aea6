"""Makes vectors in invalid/: missing and wrong seek points of snapshots (SPEC 5.9, 11.2)."""

from collections.abc import Sequence
from dataclasses import replace

from making.payloads import pack_index
from making.vectors import Outcome, ValidStream, Vector, make_patched_vector

_ORDINALS = (0, 3, 6, 8, 10)  # of the canonical frames and snapshots of `streams/snapshots-journey`
_REJECT_IDS = ("index-mismatch",)
SeekPointRow = tuple[int, int, int]  # offset, sequence and ordinal


def make_snapshot_index_faults(parent: ValidStream) -> list[Vector]:
    """Return the vectors, made from `streams/snapshots-journey`."""
    kinds = [chunk.kind for chunk in parent.stream.chunks]
    numbers = [n for n, kind in enumerate(kinds) if kind in (b"CANO", b"SNAP")]
    offsets = parent.layout.offsets
    points = [(offsets[n], n, frame) for n, frame in zip(numbers, _ORDINALS, strict=True)]
    return [
        _make_vector(
            parent,
            "index-without-snapshots",
            "5.9-1 5.9-2",
            [point for point in points if kinds[point[1]] == b"CANO"],
            "INDX lists no snapshots",
        ),
        _make_vector(
            parent,
            "index-of-another-canonical",
            "11.2-5",
            [(offset, n, 1 if frame == 0 else frame) for offset, n, frame in points],
            "no seek point has the ordinal of the CANO to which a snapshot refers",
            seek_frames=(3, 4, 7),
        ),
        _make_vector(
            parent,
            "index-of-a-snapshot",
            "11.2-5",
            [(offsets[numbers[1]], numbers[1], 0), *points[1:]],
            "the seek point of the CANO to which a snapshot refers has the offset of a snapshot",
            seek_frames=(3, 5, 6),
        ),
        _make_vector(
            parent,
            "index-of-a-later-canonical",
            "11.2-4 11.2-5",
            [(offsets[numbers[3]], numbers[3], 0), *points[1:]],
            "the seek point of the CANO to which a snapshot refers leads to another CANO",
            seek_frames=(3, 4, 7),
        ),
    ]


def _make_vector(
    parent: ValidStream,
    name: str,
    clauses: str,
    points: Sequence[SeekPointRow],
    note: str,
    seek_frames: Sequence[int] = (),
) -> Vector:
    """Return the parent with other seek points; seeking to some frames is rejected as well."""
    chunks = parent.stream.replace_chunk(len(parent.stream.chunks) - 2, payload=pack_index(points))
    outcome = Outcome(parent.frames, _REJECT_IDS)
    vector = make_patched_vector(parent, f"invalid/{name}", clauses, chunks, outcome, note)
    rejected = Outcome((), _REJECT_IDS)
    return replace(vector, seek=tuple((frame, rejected) for frame in seek_frames))
