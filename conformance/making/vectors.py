"""A vector: bytes, and the expected output of decoders."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from hashlib import sha256
from typing import Any

from making.streams import Decoded, Layout, Piece, Stream, assemble

Frames = Sequence[Decoded]


@dataclass(frozen=True)
class Outcome:
    """The expected output for a stream.

    Attributes:
        frames: The frames that must be printed, and no others.
        rejected: Reject ids that apply to the stream; empty if it can be decoded to its end.
        declined: Whether a decoder may decline the stream, which has the unlimited level.
    """

    frames: Frames
    refused: tuple[str, ...] = ()
    declined: bool = False

    def as_json(self) -> dict[str, Any]:
        """Return the entry in the manifest."""
        frames = [[f.frame, f.gaussians, f.sha256] for f in self.frames]
        said: dict[str, Any] = {"frames": frames}
        if self.refused:
            said["refused"] = list(self.refused)
        return said | ({"may_decline": True} if self.declined else {})


@dataclass(frozen=True)
class Gap:
    """The expected report of a recovering decoder (SPEC 11.4)."""

    offset: int
    byte_count: int
    refused: tuple[str, ...]
    frames_lost: int | None

    def as_json(self) -> dict[str, Any]:
        """Return the entry in the manifest."""
        lost = {"frames_lost": self.frames_lost}
        return {
            "offset": self.offset,
            "bytes": self.byte_count,
            "refused": list(self.refused),
        } | lost


@dataclass(frozen=True)
class Recovery:
    """The expected output for a stream if decoding continues after damage."""

    frames: Frames
    gaps: tuple[Gap, ...] = ()
    refused: tuple[str, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Return the entry in the manifest."""
        return Outcome(self.frames, self.refused).as_json() | {
            "gaps": [g.as_json() for g in self.gaps]
        }


@dataclass(frozen=True)
class Splice:
    """A replacement of bytes: `count` times `insert` for `remove` bytes at `at`."""

    at: int
    remove: int
    insert: bytes
    count: int = 1

    def as_json(self) -> dict[str, Any]:
        """Return the entry in the manifest."""
        said = {"at": self.at, "remove": self.remove, "insert": self.insert.hex()}
        return said | ({"count": self.count} if self.count > 1 else {})


@dataclass(frozen=True)
class Vector:
    """A stream and its expected output.

    Attributes:
        name: `category/feature`.
        note: One sentence on what it tests.
        clauses: Tested clauses of SPEC.md.
        data: The stream.
        decode: Expected output when reading through; None if this is not tested.
        recover: Expected output with recovery.
        seek: Expected output from given frames on.
        grow: Whether it is also fed in pieces.
        parent: Name of the valid stream that it patches.
        stored: Whether it is committed; otherwise it is generated from its parent on demand.
        numbers: SHA-256 of the dequantized frames.
        needs: A capability without which the stream is not tested.
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
    stored: bool = True
    splices: tuple[Splice, ...] = ()
    numbers: tuple[tuple[int, str], ...] = ()
    needs: str = ""

    @property
    def file(self) -> str:
        """Path of the stream in conformance/."""
        return f"{self.name}.quarc"

    def as_json(self) -> dict[str, Any]:
        """Return the entry of the manifest."""
        said: dict[str, Any] = {
            "name": self.name,
            "note": self.note,
            "clauses": list(self.clauses),
            "bytes": len(self.data),
            "sha256": sha256(self.data).hexdigest(),
        }
        if self.stored:
            said["file"] = self.file
        if self.parent is not None:
            splices = self.splices or splice(self.parent.data, self.data)
            patch = [each.as_json() for each in splices]
            said |= {"parent": self.parent.name, "patch": patch}
        asked: dict[str, Any] = {
            "needs": self.needs,
            "decode": self.decode and self.decode.as_json(),
            "recover": self.recover and self.recover.as_json(),
            "seek": [{"start": start} | outcome.as_json() for start, outcome in self.seek],
            "grow": self.grow,
            "numbers": [list(pair) for pair in self.numbers],
        }
        return said | {key: value for key, value in asked.items() if value}


def splice(parent: bytes, child: bytes) -> tuple[Splice, ...]:
    """Return how a child differs: the changed bytes, or one splice if its size differs."""
    if len(parent) == len(child):
        return tuple(_runs(parent, child))
    least = min(len(parent), len(child))
    start = next((i for i in range(least) if parent[i] != child[i]), least)
    tail = least - start
    end = next((i for i in range(tail) if parent[-1 - i] != child[-1 - i]), tail)
    return (Splice(start, len(parent) - end - start, child[start : len(child) - end]),)


def _runs(parent: bytes, child: bytes) -> Iterable[Splice]:
    begun: int | None = None
    for place in range(len(parent) + 1):
        differs = place < len(parent) and parent[place] != child[place]
        if differs and begun is None:
            begun = place
        elif not differs and begun is not None:
            yield Splice(begun, place - begun, child[begun:place])
            begun = None


@dataclass(frozen=True)
class Valid:
    """A valid stream as a vector, and as the parent of others."""

    vector: Vector
    stream: Stream
    layout: Layout

    @property
    def frames(self) -> list[Decoded]:
        """The expected output for its frames."""
        return list(self.vector.decode.frames) if self.vector.decode else []


def valid(
    name: str,
    note: str,
    clauses: str,
    stream: Stream,
    **more: Any,
) -> Valid:
    """Return a stream that can be decoded to its end."""
    layout = stream.layout()
    outcome = Outcome(stream.decoded())
    vector = Vector(name, note, tuple(clauses.split()), layout.data, outcome, **more)
    return Valid(vector, stream, layout)


def broken(
    parent: Valid, name: str, clauses: str, pieces: list[Piece] | bytes, said: Outcome, note: str
) -> Vector:
    """Return a patch of a valid stream, which must be rejected."""
    data = pieces if isinstance(pieces, bytes) else assemble(pieces).data
    return Vector(name, note, tuple(clauses.split()), data, said, parent=parent.vector)
