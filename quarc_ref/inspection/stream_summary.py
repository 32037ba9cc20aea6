"""Records of the contents of a stream: chunks, frames and totals."""

from dataclasses import dataclass

from quarc_ref.format.cameras import Camera
from quarc_ref.format.constants import VERSION_MAJOR
from quarc_ref.format.records import StreamHeader
from quarc_ref.inspection.symbols import MagnitudeHistograms

KILOBYTE = 1024
KINDS = ("canonical", "snapshots", "motion", "updates", "births")


@dataclass(frozen=True, slots=True)
class FrameSummary:
    """Summary of a frame.

    Attributes:
        frame: Ordinal of the frame.
        canonical: Whether the frame is a canonical frame (CANO or SNAP).
        gaussians: Number of Gaussians.
        anchors: Number of anchors, summed over all levels.
        births: Number of new Gaussians.
        deaths: Number of deleted Gaussians.
        updates: Number of Gaussians that are changed, but not deleted, by updates.
        chunk_bytes: Size of the frame's chunk in bytes, including framing.
        coded_bytes: Number of bytes of the coded planes of each kind; included in `chunk_bytes`.
        estimate_bytes: Zero-order entropy of the coded planes of each kind, in bytes.
        magnitudes: Histograms of the magnitudes of the motion symbols.
        sha256: Digest of the frame's state.
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
    magnitudes: MagnitudeHistograms
    sha256: str

    @property
    def kind(self) -> str:
        """Kind of the frame: `canonical`, `snapshot` or `moved`."""
        if not self.canonical:
            return "moved"
        return "snapshot" if self.coded_bytes["snapshots"] else "canonical"

    def as_json(self) -> dict[str, object]:
        """Return the values for `inspect --json`."""
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
    """Summary of a chunk.

    Attributes:
        kind: Type of the chunk, four letters.
        sequence: Sequence number of the chunk.
        offset: Offset of the chunk in the stream, bytes.
        byte_count: Size of the chunk in bytes, including framing.
    """

    kind: str
    sequence: int
    offset: int
    byte_count: int

    def as_json(self) -> dict[str, object]:
        """Return the values for `inspect --json`."""
        return {
            "type": self.kind,
            "sequence": self.sequence,
            "offset": self.offset,
            "bytes": self.byte_count,
        }


@dataclass(frozen=True, slots=True)
class StreamSummary:
    """Summary of a stream that has been decoded completely.

    Attributes:
        header: Header from the HEAD chunk.
        cameras: Cameras from the `came` chunk.
        metadata: Metadata from the `meta` chunk.
        total_bytes: Size of the whole stream, bytes.
        frames: Frames in order.
        chunks: Chunks in order, including those of unknown types.
    """

    header: StreamHeader
    cameras: tuple[Camera, ...]
    metadata: dict[str, str]
    total_bytes: int
    frames: tuple[FrameSummary, ...]
    chunks: tuple[ChunkSummary, ...]

    @property
    def format_version(self) -> str:
        """Lowest format version that has the features of the stream, such as `1.1`."""
        return f"{VERSION_MAJOR}.{self.header.version_minor}"

    @property
    def gaussian_count(self) -> int:
        """Number of Gaussians in the last frame; 0 in a stream without frames."""
        return self.frames[-1].gaussians if self.frames else 0

    @property
    def anchor_count(self) -> int:
        """Largest number of anchors of a frame, summed over all levels."""
        return max((frame.anchors for frame in self.frames), default=0)

    def coded_bytes(self) -> dict[str, int]:
        """Return the bytes of the stream, of each kind of coded planes, and of the overhead."""
        coded = {kind: sum(frame.coded_bytes[kind] for frame in self.frames) for kind in KINDS}
        overhead = self.total_bytes - sum(coded.values())
        return {"total": self.total_bytes, **coded, "overhead": overhead}

    def estimate_bytes(self) -> dict[str, int]:
        """Return the zero-order entropy of the coded planes of each kind, in bytes."""
        return {
            kind: round(sum(frame.estimate_bytes[kind] for frame in self.frames)) for kind in KINDS
        }

    def magnitudes(self) -> MagnitudeHistograms:
        """Return the histograms of the magnitudes of all frames' motion symbols."""
        return sum((frame.magnitudes for frame in self.frames), MagnitudeHistograms((), ()))

    def kilobytes_per_frame(self) -> dict[str, float]:
        """Return the kilobytes (1024 bytes) per frame, computed in two ways.

        `without_canonical` is the mean chunk size, including framing, of the frames that are
        neither canonical frames nor snapshots; `with_canonical` is the size of the whole
        stream divided by the number of frames.
        """
        moved_bytes = [frame.chunk_bytes for frame in self.frames if not frame.canonical]
        return {
            "without_canonical": sum(moved_bytes) / max(len(moved_bytes), 1) / KILOBYTE,
            "with_canonical": self.total_bytes / max(len(self.frames), 1) / KILOBYTE,
        }

    def as_json(self) -> dict[str, object]:
        """Return the values for `info --json`."""
        header = self.header
        first, last = (self.frames[0], self.frames[-1]) if self.frames else (None, None)
        return {
            "format_version": self.format_version,
            "level": header.level / 10,
            "frames": len(self.frames),
            "first_frame": first.frame if first else None,
            "frames_per_second": header.frames_per_second,
            "gaussians": self.gaussian_count,
            "sh_degree": header.sh_degree,
            "anchors": self.anchor_count,
            "anchor_levels": header.level_count,
            "resample_interval": header.resample_interval,
            "bytes": self.coded_bytes(),
            "kb_per_frame": self.kilobytes_per_frame(),
            "estimate_bytes": self.estimate_bytes(),
            "right_handed": bool(header.right_handed),
            "up": header.up,
            "meters_per_unit": header.meters_per_unit or None,
            "cameras": [camera.name for camera in self.cameras],
            "held_out": [camera.name for camera in self.cameras if camera.held_out],
            "metadata": self.metadata,
            "state_sha256": last.sha256 if last else None,
        }
