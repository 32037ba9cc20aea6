"""The contents of a stream as records: its chunks, its frames, and totals."""

from dataclasses import dataclass

from quarc_ref.format.cameras import Camera
from quarc_ref.format.constants import VERSION_MAJOR, VERSION_MINOR
from quarc_ref.format.records import StreamHeader
from quarc_ref.inspection.symbols import Magnitudes

KILOBYTE = 1024
KINDS = ("canonical", "snapshots", "motion", "updates", "births")


@dataclass(frozen=True, slots=True)
class FrameSummary:
    """One frame of a stream.

    Attributes:
        frame: Its ordinal.
        canonical: Whether it is a canonical frame, snapshots included.
        gaussians: How many it shows.
        anchors: How many moved it, of all levels.
        births: How many joined.
        deaths: How many left.
        updates: How many single Gaussians were changed, those among the deaths left out.
        chunk_bytes: Its chunk, framing included.
        coded_bytes: Bytes of coded planes, by kind; a part of the above.
        estimate_bytes: The zero-order estimate of the same symbols, by kind.
        magnitudes: How often its symbols have each magnitude.
        sha256: Digest of its state.
    """

    frame: int
    canonical: bool
    gaussians: int
    anchors: int
    births: int
    deaths: int
    updates: int
    chunk_bytes: int
    coded_bytes: dict[str, int]
    estimate_bytes: dict[str, float]
    magnitudes: Magnitudes
    sha256: str

    @property
    def kind(self) -> str:
        """`canonical`, `snapshot` or `moved`."""
        if not self.canonical:
            return "moved"
        return "snapshot" if self.coded_bytes["snapshots"] else "canonical"

    def as_json(self) -> dict[str, object]:
        """Return what `inspect --json` prints about it."""
        return {
            "frame": self.frame,
            "kind": self.kind,
            "gaussians": self.gaussians,
            "anchors": self.anchors,
            "births": self.births,
            "deaths": self.deaths,
            "updates": self.updates,
            "bytes": {"chunk": self.chunk_bytes, **self.coded_bytes},
            "estimate_bytes": {kind: round(size, 1) for kind, size in self.estimate_bytes.items()},
            "symbols": self.magnitudes.as_json(),
            "sha256": self.sha256,
        }


@dataclass(frozen=True, slots=True)
class ChunkSummary:
    """One chunk of a stream.

    Attributes:
        kind: Its type, four letters.
        sequence: Its number.
        offset: Its first byte.
        byte_count: Its size, framing included.
    """

    kind: str
    sequence: int
    offset: int
    byte_count: int

    def as_json(self) -> dict[str, object]:
        """Return what `inspect --json` prints about it."""
        return {
            "type": self.kind,
            "sequence": self.sequence,
            "offset": self.offset,
            "bytes": self.byte_count,
        }


@dataclass(frozen=True, slots=True)
class StreamSummary:
    """A stream that has been decoded from end to end.

    Attributes:
        header: From HEAD.
        cameras: From `came`.
        metadata: From `meta`.
        total_bytes: Size of the whole stream.
        frames: In order.
        chunks: In order, also those of types that are unknown.
    """

    header: StreamHeader
    cameras: tuple[Camera, ...]
    metadata: dict[str, str]
    total_bytes: int
    frames: tuple[FrameSummary, ...]
    chunks: tuple[ChunkSummary, ...]

    @property
    def gaussian_count(self) -> int:
        """Gaussians of the last frame; 0 in a stream without frames."""
        return self.frames[-1].gaussians if self.frames else 0

    @property
    def anchor_count(self) -> int:
        """Anchors of all levels together, in the frame that has most."""
        return max((frame.anchors for frame in self.frames), default=0)

    def coded_bytes(self) -> dict[str, int]:
        """Return the bytes of coded planes by kind, the rest as overhead, and the total."""
        coded = {kind: sum(frame.coded_bytes[kind] for frame in self.frames) for kind in KINDS}
        overhead = self.total_bytes - sum(coded.values())
        return {"total": self.total_bytes, **coded, "overhead": overhead}

    def estimate_bytes(self) -> dict[str, int]:
        """Return the zero-order estimate of the same symbols by kind."""
        return {
            kind: round(sum(frame.estimate_bytes[kind] for frame in self.frames)) for kind in KINDS
        }

    def magnitudes(self) -> Magnitudes:
        """Return how often the symbols of all frames have each magnitude."""
        return sum((frame.magnitudes for frame in self.frames), Magnitudes((), ()))

    def kilobytes_per_frame(self) -> dict[str, float]:
        """Return KB of 1024 bytes per frame.

        `without_canonical` is the mean over the frames that are not canonical
        of their chunks, framing included; `with_canonical` the whole stream
        over all frames.
        """
        moved = [frame.chunk_bytes for frame in self.frames if not frame.canonical]
        return {
            "without_canonical": sum(moved) / max(len(moved), 1) / KILOBYTE,
            "with_canonical": self.total_bytes / max(len(self.frames), 1) / KILOBYTE,
        }

    def as_json(self) -> dict[str, object]:
        """Return what `info --json` prints."""
        last = self.frames[-1] if self.frames else None
        return {
            "format_version": f"{VERSION_MAJOR}.{VERSION_MINOR}",
            "level": self.header.level / 10,
            "frames": len(self.frames),
            "frames_per_second": self.header.frames_per_second,
            "gaussians": self.gaussian_count,
            "anchors": self.anchor_count,
            "bytes": self.coded_bytes(),
            "kb_per_frame": self.kilobytes_per_frame(),
            "estimate_bytes": self.estimate_bytes(),
            "cameras": [camera.name for camera in self.cameras],
            "held_out": [camera.name for camera in self.cameras if camera.held_out],
            "metadata": self.metadata,
            "state_sha256": last.sha256 if last else None,
        }
