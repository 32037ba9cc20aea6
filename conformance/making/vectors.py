"""Vectors: streams with the expected output of decoders."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from hashlib import sha256
from typing import Any

from making.streams import Chunk, DecodedFrame, Layout, Stream, assemble

Frames = Sequence[DecodedFrame]


@dataclass(frozen=True)
class Outcome:
    """The expected output for a stream.

    Attributes:
        frames: Frames that a decoder must print; it must not print others.
        reject_ids: Allowed reject ids; empty if the stream can be decoded to its end.
        may_decline: Whether a decoder may decline the stream; true only at the unlimited level.
    """

    frames: Frames
    reject_ids: tuple[str, ...] = ()
    may_decline: bool = False

    def as_json(self) -> dict[str, Any]:
        """Return the JSON value that represents this in the manifest."""
        frames = [[f.frame, f.gaussians, f.sha256] for f in self.frames]
        entry: dict[str, Any] = {"frames": frames}
        if self.reject_ids:
            entry["refused"] = list(self.reject_ids)
        return entry | ({"may_decline": True} if self.may_decline else {})


@dataclass(frozen=True)
class Gap:
    """A gap that a recovering decoder must report (SPEC 11.4)."""

    offset: int
    byte_count: int
    reject_ids: tuple[str, ...]
    frames_lost: int | None

    def as_json(self) -> dict[str, Any]:
        """Return the JSON value that represents this in the manifest."""
        lost_entry = {"frames_lost": self.frames_lost}
        return {
            "offset": self.offset,
            "bytes": self.byte_count,
            "refused": list(self.reject_ids),
        } | lost_entry


@dataclass(frozen=True)
class Recovery:
    """The expected output of a decoder that recovers damaged streams (SPEC 11.4)."""

    frames: Frames
    gaps: tuple[Gap, ...] = ()
    reject_ids: tuple[str, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Return the JSON value that represents this in the manifest."""
        return Outcome(self.frames, self.reject_ids).as_json() | {
            "gaps": [g.as_json() for g in self.gaps]
        }


@dataclass(frozen=True)
class Splice:
    """A change to a parent: `copies` copies of `inserted` replace `removed_bytes` at `offset`."""

    offset: int
    removed_bytes: int
    inserted: bytes
    copies: int = 1

    def as_json(self) -> dict[str, Any]:
        """Return the JSON value that represents this in the manifest."""
        entry = {"at": self.offset, "remove": self.removed_bytes, "insert": self.inserted.hex()}
        return entry | ({"count": self.copies} if self.copies > 1 else {})


@dataclass(frozen=True)
class Vector:
    """A stream and its expected output.

    Attributes:
        name: `category/feature`.
        note: Short description of the tested feature or fault.
        clauses: Numbers of the tested clauses of SPEC.md.
        data: Bytes of the stream.
        decode: Expected output of decoding from the start; None if this is not tested.
        recover: Expected output with recovery; None if this is not tested.
        seek: Ordinals of frames to seek to, each with the expected output from that frame on.
        grow: Whether the stream is also fed to the decoder chunk by chunk.
        parent: Vector of the valid stream that this one patches.
        is_stored: Whether the stream is a file; otherwise it is generated from its parent.
        splices: Patch that turns the parent into this stream; if empty, it is computed.
        number_digests: SHA-256 of the dequantized numbers of each frame.
        needs: Capability that a decoder must have to be tested with the stream.
    """

    name: str
    note: str
    clauses: tuple[str, ...]
    data: bytes
    decode: Outcome | None = None
    recover: Recovery | None = None
    seek: tuple[tuple[int, Outcome], ...] = ()
    grow: bool = False
    parent: "Vector | None" = None
    is_stored: bool = True
    splices: tuple[Splice, ...] = ()
    number_digests: tuple[tuple[int, str], ...] = ()
    needs: str = ""

    @property
    def file_name(self) -> str:
        """Path of the stream in conformance/."""
        return f"{self.name}.quarc"

    def as_json(self) -> dict[str, Any]:
        """Return the vector's entry in the manifest."""
        entry: dict[str, Any] = {
            "name": self.name,
            "note": self.note,
            "clauses": list(self.clauses),
            "bytes": len(self.data),
            "sha256": sha256(self.data).hexdigest(),
        }
        if self.is_stored:
            entry["file"] = self.file_name
        if self.parent is not None:
            splices = self.splices or find_splices(self.parent.data, self.data)
            patch = [change.as_json() for change in splices]
            entry |= {"parent": self.parent.name, "patch": patch}
        optional_entries: dict[str, Any] = {
            "needs": self.needs,
            "decode": self.decode and self.decode.as_json(),
            "recover": self.recover and self.recover.as_json(),
            "seek": [{"start": start} | outcome.as_json() for start, outcome in self.seek],
            "grow": self.grow,
            "numbers": [list(pair) for pair in self.number_digests],
        }
        return entry | {key: value for key, value in optional_entries.items() if value}


def find_splices(parent: bytes, child: bytes) -> tuple[Splice, ...]:
    """Return the splices that turn the parent into the child; one if their sizes differ."""
    if len(parent) == len(child):
        return tuple(_find_equal_size_splices(parent, child))
    min_size = min(len(parent), len(child))
    start = next((i for i in range(min_size) if parent[i] != child[i]), min_size)
    max_suffix_size = min_size - start
    suffix_size = next(
        (i for i in range(max_suffix_size) if parent[-1 - i] != child[-1 - i]), max_suffix_size
    )
    return (
        Splice(start, len(parent) - suffix_size - start, child[start : len(child) - suffix_size]),
    )


def _find_equal_size_splices(parent: bytes, child: bytes) -> Iterable[Splice]:
    start: int | None = None
    for byte_index in range(len(parent) + 1):
        differs = byte_index < len(parent) and parent[byte_index] != child[byte_index]
        if differs and start is None:
            start = byte_index
        elif not differs and start is not None:
            yield Splice(start, byte_index - start, child[start:byte_index])
            start = None


@dataclass(frozen=True)
class ValidStream:
    """A valid stream, which can be the parent of other vectors."""

    vector: Vector
    stream: Stream
    layout: Layout

    @property
    def frames(self) -> list[DecodedFrame]:
        """The expected output for each frame."""
        return list(self.vector.decode.frames) if self.vector.decode else []


def make_valid_stream(
    name: str,
    note: str,
    clauses: str,
    stream: Stream,
    **options: Any,
) -> ValidStream:
    """Return a stream that can be decoded to its end."""
    layout = stream.make_layout()
    outcome = Outcome(stream.list_decoded_frames())
    vector = Vector(name, note, tuple(clauses.split()), layout.data, outcome, **options)
    return ValidStream(vector, stream, layout)


def make_patched_vector(
    parent: ValidStream,
    name: str,
    clauses: str,
    stream: list[Chunk] | bytes,
    outcome: Outcome,
    note: str,
) -> Vector:
    """Return a vector that is stored as a patch of a valid stream."""
    data = stream if isinstance(stream, bytes) else assemble(stream).data
    return Vector(name, note, tuple(clauses.split()), data, outcome, parent=parent.vector)
