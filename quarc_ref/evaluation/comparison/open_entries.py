"""Opens the entries named on the command line, streams first, because they define the cameras."""

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

_FOURDGS_SUFFIX, _PLY_SUFFIX = ".4dgs", ".ply"


@dataclass(frozen=True, slots=True)
class EntrySource:
    """An entry that has not been opened yet, with its label.

    Attributes:
        label: Method and operating point.
        path: Path of the entry.
        byte_count: Size, in bytes, of the coded files from which a folder of renders was made;
            None if unknown.
    """

    label: Label
    path: Path
    byte_count: int | None = None


@dataclass(frozen=True, slots=True)
class ComparisonOptions:
    """Options of a comparison.

    Attributes:
        capture: Folder of the capture whose pictures are the ground truth; None to use the
            renderings of the first entry.
        cameras: Names of the cameras to compare on; empty for the held-out cameras.
        downscale: Factor by which the capture's pictures are downscaled; ignored if a stream
            determines the size.
        accept_other_capture: Whether to accept streams that were encoded from another capture.
    """

    capture: Path | None = None
    cameras: tuple[str, ...] = ()
    downscale: int = 1
    accept_other_capture: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class ComparisonInputs:
    """Opened entries, ground truth and cameras of a comparison.

    Attributes:
        entries: Opened entries in the order of the command line.
        capture: Capture whose pictures are the ground truth; None to use the renderings of the
            first entry.
        cameras: Cameras to compare on, by name.
        frames_per_second: Frame rate of all entries.
    """

    entries: list[Entry]
    capture: Capture | None
    cameras: dict[str, Camera]
    frames_per_second: float


def open_entries(
    sources: Sequence[EntrySource],
    options: ComparisonOptions,
    on_progress: Callable[[str, int, int], None],
) -> ComparisonInputs:
    """Open all entries and the capture of a comparison.

    Args:
        sources: The entries to open.
        options: Options of the comparison.
        on_progress: Called after every inspected frame of a stream with the name of the stage, the
            number of inspected frames and the total number of frames.

    Raises:
        BitstreamError: A stream is malformed.
        CaptureError: The capture cannot be read.
        MismatchError: An entry does not match the capture, or cannot be compared.
        UnreadableFramesError: A file of another method is malformed.
        ImportError: `fourdgs` is not installed but needed for a `.4dgs` file.
        OSError: A file or folder cannot be read.
    """
    streams = {
        index: open_stream(source.path, source.label, on_progress)
        for index, source in enumerate(sources)
        if _is_stream(source.path)
    }
    capture = _open_capture(list(streams.values()), options)
    available_cameras = _list_cameras(list(streams.values()), capture)
    cameras = _choose_cameras(available_cameras, options.cameras)
    frames_per_second = _find_frame_rate(list(streams.values()), capture)
    entries: list[Entry] = []
    for index, source in enumerate(sources):
        if index in streams:
            entries.append(streams[index].entry)
        else:
            entries.append(_open_non_stream(source, cameras, frames_per_second))
    return ComparisonInputs(entries, capture, cameras, frames_per_second)


def _is_stream(path: Path) -> bool:
    return path.is_file() and path.suffix.lower() not in (_FOURDGS_SUFFIX, _PLY_SUFFIX)


def _open_non_stream(
    source: EntrySource, cameras: Mapping[str, Camera], frames_per_second: float
) -> Entry:
    path = source.path
    capture_kind = describe_capture(path)
    if capture_kind is not None:
        message = (
            f"{path} is {capture_kind}, not an entry: use --capture {path} to measure entries "
            "on this capture"
        )
        raise EntryError(message)
    if path.suffix.lower() == _FOURDGS_SUFFIX:
        return open_fourdgs(path, source.label, frames_per_second)
    if path.is_file() or any(path.glob(f"*{_PLY_SUFFIX}")):
        return open_plys(path, source.label)
    fourdgs_files = sorted(path.glob(f"*{_FOURDGS_SUFFIX}"))
    if fourdgs_files:
        message = f"{path} is a folder: use the file {fourdgs_files[0]}, which contains all frames"
        raise EntryError(message)
    return open_renders(path, source.label, cameras, source.byte_count)


def _open_capture(streams: Sequence[OpenStream], options: ComparisonOptions) -> Capture | None:
    if options.capture is None:
        return None
    if not streams:
        return open_capture(options.capture, CaptureOptions(downscale=options.downscale))
    captures = [
        open_same_capture(
            stream.summary, options.capture, accept_other_capture=options.accept_other_capture
        )
        for stream in streams
    ]
    return captures[0]


def _list_cameras(streams: Sequence[OpenStream], capture: Capture | None) -> list[Camera]:
    """Return the cameras that the streams share; if there are no streams, those of the capture."""
    if not streams:
        if capture is None:
            message = "no entry is a stream, so --capture is needed to define the cameras"
            raise EntryError(message)
        return list(capture.cameras)
    first_stream, *other_streams = streams
    for other_stream in other_streams:
        for camera, other_camera in zip(
            first_stream.summary.cameras, other_stream.summary.cameras, strict=False
        ):
            if (camera.name, camera.width, camera.height) != (
                other_camera.name,
                other_camera.width,
                other_camera.height,
            ):
                message = (
                    f"{first_stream.entry.label} and {other_stream.entry.label} have different "
                    "cameras: "
                    f"{camera.name} ({camera.width} x {camera.height}) and "
                    f"{other_camera.name} ({other_camera.width} x {other_camera.height})"
                )
                raise EntryError(message)
    return list(first_stream.summary.cameras)


def _choose_cameras(available_cameras: Sequence[Camera], names: Sequence[str]) -> dict[str, Camera]:
    camera_by_name = {camera.name: camera for camera in available_cameras}
    unknown_names = [name for name in names if name not in camera_by_name]
    if unknown_names:
        message = (
            f"there is no camera {unknown_names[0]}; the cameras are {', '.join(camera_by_name)}"
        )
        raise EntryError(message)
    held_out_names = [camera.name for camera in available_cameras if camera.held_out]
    chosen_names = list(names) or held_out_names or list(camera_by_name)
    if not chosen_names:
        message = "the streams have no cameras on which to compare them"
        raise EntryError(message)
    return {name: camera_by_name[name] for name in chosen_names}


def _find_frame_rate(streams: Sequence[OpenStream], capture: Capture | None) -> float:
    if capture is not None:
        return capture.frames_per_second
    return streams[0].summary.header.frames_per_second
