"""What a stream is made of: counts, real bytes by kind, the estimate beside them.

The whole stream is decoded, so that whatever is reported of it has been proved.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from quarc_ref.decoder.decode_stream import StreamDecoder
from quarc_ref.decoder.digest import compute_digest
from quarc_ref.decoder.reconstruct import State
from quarc_ref.evaluation.estimate import estimate_births, estimate_gaussians, estimate_motion
from quarc_ref.format import container, wire
from quarc_ref.format.chunk_reader import split_chunks
from quarc_ref.format.constants import VERSION_MAJOR, VERSION_MINOR
from quarc_ref.format.container import Chunk
from quarc_ref.format.errors import BitstreamError
from quarc_ref.format.gaussian_planes import read_births, read_canonical
from quarc_ref.format.records import Camera, StreamHeader

KILOBYTE = 1024
KINDS = ("canonical", "motion", "births")


@dataclass(frozen=True, slots=True)
class FrameSummary:
    """One frame of a stream.

    Attributes:
        frame: Its ordinal.
        canonical: Whether it is one.
        gaussians: How many it shows.
        anchors: How many moved it, of all levels.
        births: How many joined.
        deaths: How many left.
        chunk_bytes: Its chunk, framing included.
        coded_bytes: Of these, coded planes by kind.
        estimate_bytes: The zero-order estimate of the same symbols, by kind.
        sha256: Digest of its state.
    """

    frame: int
    canonical: bool
    gaussians: int
    anchors: int
    births: int
    deaths: int
    chunk_bytes: int
    coded_bytes: dict[str, int]
    estimate_bytes: dict[str, float]
    sha256: str


@dataclass(frozen=True, slots=True)
class StreamSummary:
    """A stream that has been decoded from end to end.

    Attributes:
        header: From HEAD.
        cameras: From `came`.
        metadata: From `meta`.
        total_bytes: Of the whole.
        frames: In order.
    """

    header: StreamHeader
    cameras: tuple[Camera, ...]
    metadata: dict[str, str]
    total_bytes: int
    frames: tuple[FrameSummary, ...]

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


def count_frames(data: bytes) -> int:
    """Return how many frames there are before the end, or before the first damage, undecoded."""
    count = 0
    with suppress(BitstreamError):
        for chunk in split_chunks(data):
            count += chunk.kind in (container.CANO, container.FRAM)
    return count


def inspect_stream(
    data: bytes, note: Callable[[str, int, int], None] | None = None
) -> StreamSummary:
    """Decode a stream and sum up what it is made of.

    Args:
        data: A stream.
        note: Is told of every frame: stage, done, total.

    Raises:
        BitstreamError: What is wrong with the bytes.
    """
    decoder, total = StreamDecoder(), count_frames(data)
    frames: list[FrameSummary] = []
    for chunk in split_chunks(data):
        state = decoder.push(chunk)
        if state is None:
            continue
        frames.append(_summarize(chunk, state))
        if note is not None:
            note("inspect", len(frames), total)
    return StreamSummary(
        decoder.header, decoder.cameras, decoder.metadata, len(data), tuple(frames)
    )


def _summarize(chunk: Chunk, state: State) -> FrameSummary:
    scene, header = state.scene, state.scene.header
    coded: dict[str, int] = dict.fromkeys(KINDS, 0)
    estimate: dict[str, float] = dict.fromkeys(KINDS, 0.0)
    births = deaths = 0
    if chunk.kind == container.CANO:
        canonical = wire.parse_canonical(chunk.payload)
        coded["canonical"] = sum(section.byte_count() for section in canonical.sections)
        estimate["canonical"] = estimate_gaussians(read_canonical(canonical, header.code_planes))
    else:
        frame = wire.parse_frame(chunk.payload)
        births, deaths = frame.birth_count, frame.death_count
        coded["motion"], coded["births"] = frame.motion.byte_count(), frame.births.byte_count()
        newborn = read_births(frame.births, header.code_planes, births)
        estimate["motion"] = estimate_motion(state.symbols)
        estimate["births"] = estimate_births(newborn) if births else 0.0
    return FrameSummary(
        scene.frame,
        chunk.kind == container.CANO,
        scene.count,
        sum(level.shape[1] for level in state.symbols),
        births,
        deaths,
        chunk.byte_count(),
        coded,
        estimate,
        compute_digest(scene),
    )
