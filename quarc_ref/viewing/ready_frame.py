"""A decoded frame with what is told of it."""

from collections.abc import Mapping
from dataclasses import dataclass

from quarc_ref.format import container, wire
from quarc_ref.format.container import ChunkHeader
from quarc_ref.inspection.inspect_stream import count_coded_bytes
from quarc_ref.inspection.stream_summary import KILOBYTE, KINDS
from quarc_ref.playback import Frame
from quarc_ref.streams.chunk_reader import ChunkReader
from quarc_ref.streams.source import Source
from quarc_ref.viewing.outline import Outline
from quarc_ref.viewing.splat_frame import SplatFrame, make_splats


@dataclass(frozen=True, slots=True, eq=False)
class ReadyFrame:
    """One frame, ready to be shown.

    Attributes:
        frame: Its ordinal.
        canonical: Whether it is one.
        seconds: How long it took to decode.
        sizes: Its bytes by kind, `overhead` and `total`.
        splats: What is drawn.
    """

    frame: int
    canonical: bool
    seconds: float
    sizes: Mapping[str, int]
    splats: SplatFrame

    @property
    def nbytes(self) -> int:
        """Memory that the frame takes."""
        return self.splats.nbytes


class Preparer:
    """Makes frames of a stream ready.

    Args:
        source: The stream.
        outline: Of the stream.
        unit: From `choose_unit`.
    """

    def __init__(self, source: Source, outline: Outline, unit: float) -> None:
        self._source, self._outline, self._unit = source, outline, unit

    def __call__(self, decoded: Frame) -> ReadyFrame:
        """Return a frame of which nothing is the decoder's any more.

        Raises:
            BitstreamError: What is wrong with its chunk.
            SourceError: What holds the stream does not give its bytes.
        """
        frame = decoded.scene.frame
        header = self._outline.chunks[frame - self._outline.first_frame]
        return ReadyFrame(
            frame,
            header.kind in container.CANONICAL,
            decoded.nanoseconds / 1e9,
            _measure_chunk(self._source, header),
            make_splats(decoded.splats, self._unit),
        )


def describe_frame(ready: ReadyFrame, rate: float | None, pace: float) -> str:
    """Return a table in Markdown.

    Args:
        ready: The frame.
        rate: Frames that go to the page per second; None while pausing.
        pace: Frames per second that the stream asks for.
    """
    sent = "paused" if rate is None else f"{rate:.1f} per second, of {pace:g}"
    rows = {
        "frame": f"{ready.frame}, {'canonical' if ready.canonical else 'moved'}",
        "Gaussians": f"{ready.splats.count:,}",
        **{name: f"{ready.sizes[name]:,} bytes" for name in KINDS if ready.sizes[name]},
        "overhead": f"{ready.sizes['overhead']:,} bytes",
        "this frame": f"{ready.sizes['total'] / KILOBYTE:,.2f} KB",
        "decoded in": f"{ready.seconds * 1000:.0f} ms",
        "sent": sent,
    }
    lines = [f"| {name} | {value} |" for name, value in rows.items()]
    return "\n".join(["| | |", "|:--|--:|", *lines])


def _measure_chunk(source: Source, header: ChunkHeader) -> dict[str, int]:
    reader = ChunkReader(source)
    head = reader.read_chunk()
    updates = head is not None and wire.parse_stream_header(head.payload).updates
    reader.seek(header.offset, header.sequence)
    chunk = reader.take(header)
    coded, total = count_coded_bytes(chunk, updates=updates), chunk.byte_count()
    return {**coded, "overhead": total - sum(coded.values()), "total": total}
