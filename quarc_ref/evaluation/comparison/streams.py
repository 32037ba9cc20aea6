"""Opens streams as entries; each stream is decoded once, starting at the first requested frame."""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from quarc_ref.decoder import Scene, Splats, dequantize
from quarc_ref.evaluation.comparison.entries import EntryError, EntryInfo, Label, SplatEntry
from quarc_ref.evaluation.same_capture import describe_doubt, read_start_frame
from quarc_ref.inspection.inspect_stream import inspect_stream
from quarc_ref.inspection.stream_summary import StreamSummary
from quarc_ref.streams import decode


@dataclass(frozen=True, slots=True, eq=False)
class OpenStream:
    """An opened stream.

    Attributes:
        entry: The stream as an entry.
        summary: Summary of the stream.
    """

    entry: SplatEntry
    summary: StreamSummary


def open_stream(
    path: Path, label: Label, on_progress: Callable[[str, int, int], None]
) -> OpenStream:
    """Open a stream.

    Args:
        path: Path of the file.
        label: Method and operating point.
        on_progress: Called after every inspected frame with the name of the stage, the number of
            inspected frames and the total number of frames.

    Raises:
        BitstreamError: The stream is malformed.
        OSError: The file cannot be read.
    """
    data = path.read_bytes()
    summary = inspect_stream(data, on_progress)
    frames = tuple(frame.frame for frame in summary.frames)
    info = EntryInfo("stream", frames, summary.total_bytes)
    entry = SplatEntry(label, info, _StreamDecoder(data).load, summary.cameras)
    return OpenStream(entry, summary)


def list_doubts(summary: StreamSummary, fingerprint: str, cameras: Collection[str]) -> list[str]:
    """Return why the figures of a stream may be too low, or too high, for a fair comparison.

    Args:
        summary: Summary of the stream.
        fingerprint: Fingerprint of the capture whose pictures are the ground truth.
        cameras: Names of the cameras to compare on.
    """
    doubt = describe_doubt(summary.metadata.get("fingerprint"), fingerprint)
    doubts = [] if doubt is None else [doubt]
    training_names = [
        camera.name for camera in summary.cameras if camera.name in cameras and not camera.held_out
    ]
    if training_names:
        verb = "is" if len(training_names) == 1 else "are"
        names = ", ".join(training_names)
        doubts.append(f"{names} {verb} not held out of the stream, which favors it")
    return doubts


def list_held_out(streams: Iterable[OpenStream]) -> str:
    """Return the held-out cameras of each stream as text, such as `cam00 of a; none of b`."""
    return "; ".join(
        f"{', '.join(it.name for it in stream.summary.cameras if it.held_out) or 'none'} of "
        f"{stream.entry.label}"
        for stream in streams
    )


def require_equal_starts(streams: Sequence[OpenStream]) -> None:
    """Raise EntryError if the frames 0 of two streams are different frames of the capture."""
    starts = [read_start_frame(stream.summary) for stream in streams]
    for stream, start in zip(streams, starts, strict=True):
        if start != starts[0]:
            message = (
                f"{streams[0].entry.label} begins at frame {starts[0]} of the capture, and "
                f"{stream.entry.label} at frame {start}"
            )
            raise EntryError(message)


def reject_downscale(downscale: int, streams: Sequence[OpenStream]) -> None:
    """Raise EntryError if a picture size is requested, but a stream determines it."""
    if downscale != 1 and streams:
        message = (
            "--downscale is not for streams: pictures have the size at which "
            f"{streams[0].entry.label} was encoded"
        )
        raise EntryError(message)


class _StreamDecoder:
    """Decodes the frames of a stream on demand, in ascending order."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._scenes: Iterator[Scene] | None = None

    def load(self, frame: int) -> Splats:
        if self._scenes is None:
            self._scenes = decode(self._data, frame)
        return dequantize(next(scene for scene in self._scenes if scene.frame == frame))
