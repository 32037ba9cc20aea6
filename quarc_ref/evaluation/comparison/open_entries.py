"""Opens the entries of the command line, starting with streams, which have cameras."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from quarc_ref.datasets.capture import Capture
from quarc_ref.datasets.layouts.table import describe_capture
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.evaluation.comparison.entries import Entry, EntryError, Label
from quarc_ref.evaluation.comparison.gaussian_files import open_fourdgs, open_plys
from quarc_ref.evaluation.comparison.renders import open_renders
from quarc_ref.evaluation.comparison.streams import OpenStream, open_stream
from quarc_ref.evaluation.same_capture import open_same_capture
from quarc_ref.format.cameras import Camera

_STREAM, _FOURDGS, _PLY = ".quarc", ".4dgs", ".ply"


@dataclass(frozen=True, slots=True)
class EntrySource:
    """A named entry to compare.

    Attributes:
        label: Method and operating point.
        path: Path of the entry.
        byte_count: Size of the files that renders were made from; None if unknown.
    """

    label: Label
    path: Path
    byte_count: int | None = None


@dataclass(frozen=True, slots=True)
class ComparisonOptions:
    """Options of a comparison.

    Attributes:
        capture: Folder of the capture whose pictures are the ground truth; None to use
            the first entry.
        cameras: Names of the cameras to compare on; empty for the held-out ones.
        downscale: Factor by which the capture's pictures are downscaled, if no stream
            determines the size.
        other_capture: Whether streams may have been made from another capture.
    """

    capture: Path | None = None
    cameras: tuple[str, ...] = ()
    downscale: int = 1
    other_capture: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class OpenComparison:
    """Opened entries, ground truth and cameras of a comparison.

    Attributes:
        entries: Opened entries in the order of their names.
        capture: Capture whose pictures are the ground truth; None to use the first entry.
        cameras: Cameras to compare on, by name.
        frames_per_second: Frame rate of all entries.
    """

    entries: list[Entry]
    capture: Capture | None
    cameras: dict[str, Camera]
    frames_per_second: float


def open_entries(
    named: Sequence[EntrySource],
    wanted: ComparisonOptions,
    on_progress: Callable[[str, int, int], None],
) -> OpenComparison:
    """Open all entries and the capture of a comparison.

    Args:
        named: The entries to open.
        wanted: Options of the comparison.
        on_progress: Called for every frame of a stream that is inspected.

    Raises:
        BitstreamError: A stream is malformed.
        CaptureError: The capture cannot be read.
        MismatchError: An entry does not match the capture, or cannot be compared.
        UnreadableFramesError: A file of another method is malformed.
        ImportError: `fourdgs` is not installed but needed for a `.4dgs` file.
        OSError: A file or folder cannot be read.
    """
    streams = {
        index: open_stream(each.path, each.label, on_progress)
        for index, each in enumerate(named)
        if _is_stream(each.path)
    }
    capture = _open_capture(list(streams.values()), wanted)
    there = _list_cameras(list(streams.values()), capture)
    cameras = _choose_cameras(there, wanted.cameras)
    pace = _find_pace(list(streams.values()), capture)
    entries: list[Entry] = []
    for index, each in enumerate(named):
        if index in streams:
            entries.append(streams[index].entry)
        else:
            entries.append(_open_other(each, cameras, pace))
    return OpenComparison(entries, capture, cameras, pace)


def _is_stream(path: Path) -> bool:
    return path.is_file() and path.suffix.lower() not in (_FOURDGS, _PLY)


def _open_other(each: EntrySource, cameras: Mapping[str, Camera], pace: float) -> Entry:
    path = each.path
    what = describe_capture(path)
    if what is not None:
        message = f"{path} is {what}, not an entry: to measure entries on it, use --capture {path}"
        raise EntryError(message)
    if path.suffix.lower() == _FOURDGS:
        return open_fourdgs(path, each.label, pace)
    if path.is_file() or any(path.glob(f"*{_PLY}")):
        return open_plys(path, each.label)
    whole = sorted(path.glob(f"*{_FOURDGS}"))
    if whole:
        message = f"{path} is a folder: name the file in it, {whole[0]}, which has all frames"
        raise EntryError(message)
    return open_renders(path, each.label, cameras, each.byte_count)


def _open_capture(streams: Sequence[OpenStream], wanted: ComparisonOptions) -> Capture | None:
    if wanted.capture is None:
        return None
    if not streams:
        return open_capture(wanted.capture, CaptureOptions(downscale=wanted.downscale))
    captures = [
        open_same_capture(each.summary, wanted.capture, other_capture=wanted.other_capture)
        for each in streams
    ]
    return captures[0]


def _list_cameras(streams: Sequence[OpenStream], capture: Capture | None) -> list[Camera]:
    """Return the cameras of the first stream, or of the capture; all streams must agree."""
    if not streams:
        if capture is None:
            message = "none of the entries is a stream, so --capture is needed for the cameras"
            raise EntryError(message)
        return list(capture.cameras)
    first, *others = streams
    for other in others:
        for ours, theirs in zip(first.summary.cameras, other.summary.cameras, strict=False):
            if (ours.name, ours.width, ours.height) != (theirs.name, theirs.width, theirs.height):
                message = (
                    f"{first.entry.label} and {other.entry.label} differ in cameras: {ours.name}, "
                    f"{ours.width} x {ours.height}, against {theirs.name}, {theirs.width} x "
                    f"{theirs.height}"
                )
                raise EntryError(message)
    return list(first.summary.cameras)


def _choose_cameras(there: Sequence[Camera], names: Sequence[str]) -> dict[str, Camera]:
    by_name = {camera.name: camera for camera in there}
    unknown = [name for name in names if name not in by_name]
    if unknown:
        message = f"there is no camera {unknown[0]}; the cameras are {', '.join(by_name)}"
        raise EntryError(message)
    held_out = [camera.name for camera in there if camera.held_out]
    chosen = list(names) or held_out or list(by_name)
    if not chosen:
        message = "the streams have no cameras to compare"
        raise EntryError(message)
    return {name: by_name[name] for name in chosen}


def _find_pace(streams: Sequence[OpenStream], capture: Capture | None) -> float:
    if capture is not None:
        return capture.frames_per_second
    return streams[0].summary.header.frames_per_second
