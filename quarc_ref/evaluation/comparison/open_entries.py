"""Opens the entries named on the command line, streams first, because they define the cameras."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import zip_longest
from pathlib import Path

from quarc_ref.datasets.calibration import DownscaleError
from quarc_ref.datasets.capture import Capture
from quarc_ref.datasets.layouts.table import describe_capture
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.evaluation.comparison.entries import Entry, EntryError, Label
from quarc_ref.evaluation.comparison.gaussian_files import (
    PLY_SUFFIX,
    list_plys,
    open_fourdgs,
    open_plys,
)
from quarc_ref.evaluation.comparison.renders import open_renders
from quarc_ref.evaluation.comparison.streams import (
    OpenStream,
    list_doubts,
    list_held_out,
    open_stream,
    reject_downscale,
    require_equal_starts,
)
from quarc_ref.evaluation.same_capture import MismatchError, open_same_capture
from quarc_ref.format.cameras import Camera
from quarc_ref.format.errors import BitstreamError
from quarc_ref.inspection.stream_summary import StreamSummary

_FOURDGS_SUFFIX = ".4dgs"


@dataclass(frozen=True, slots=True)
class EntrySource:
    """An entry that has not been opened yet, with its label.

    Attributes:
        label: Method and operating point.
        path: Path of the entry.
        byte_count: Size, in bytes, of the files that the method stores for all frames of the
            entry, as stated by the user; None to measure the files at `path`.
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
        cameras: Names of the cameras to compare on; empty for the cameras that are held out of all
            streams or, without a capture, of the first stream.
        downscale: Factor by which the capture's pictures are downscaled; it must be 1 if an entry
            is a stream, which determines the size.
        accept_other_capture: Whether to accept streams that were encoded from another capture.
        stop: Frame before which the comparison ends; None to compare all frames.
    """

    capture: Path | None = None
    cameras: tuple[str, ...] = ()
    downscale: int = 1
    accept_other_capture: bool = False
    stop: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class ComparisonInputs:
    """Opened entries, ground truth and cameras of a comparison.

    Attributes:
        entries: Opened entries in the order of the command line.
        capture: Capture whose pictures are the ground truth; None to use the renderings of the
            first entry.
        cameras: Cameras to compare on, by name.
        frames_per_second: Frame rate of all entries.
        doubts: Messages of `list_doubts` for all streams, each with the path of its stream.
    """

    entries: list[Entry]
    capture: Capture | None
    cameras: dict[str, Camera]
    frames_per_second: float
    doubts: tuple[str, ...] = ()


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
    streams: dict[int, OpenStream] = {}
    for index, source in enumerate(sources):
        if _is_stream(source.path):
            with _name_path_in_errors(source.path):
                streams[index] = open_stream(source.path, source.label, on_progress)
    require_equal_starts(list(streams.values()))
    reject_downscale(options.downscale, list(streams.values()))
    capture = _open_capture(
        [(sources[index].path, stream.summary) for index, stream in streams.items()], options
    )
    available_cameras = _list_cameras(list(streams.values()), capture)
    measured_streams = [] if capture is None else list(streams.values())
    cameras = _choose_cameras(available_cameras, options.cameras, measured_streams)
    frames_per_second = _find_frame_rate(list(streams.values()), capture)
    entries: list[Entry] = []
    for index, source in enumerate(sources):
        if index in streams:
            entries.append(streams[index].entry)
            _reject_stated_size(source)
        else:
            entries.append(_open_non_stream(source, cameras, frames_per_second))
            _state_size(entries[-1], source.byte_count)
    doubts = (
        f"{sources[index].path}: {doubt}"
        for index, stream in streams.items()
        if capture is not None
        for doubt in list_doubts(stream.summary, capture.fingerprint, cameras)
    )
    return ComparisonInputs(entries, capture, cameras, frames_per_second, tuple(doubts))


@contextmanager
def _name_path_in_errors(path: Path) -> Iterator[None]:
    """Prefix the message of an error about a stream with the path of the stream."""
    try:
        yield
    except (BitstreamError, MismatchError) as error:
        error.args = (f"{path}: {error.args[0]}",)
        raise


def _reject_stated_size(stream: EntrySource) -> None:
    """Raise EntryError if a size is stated for a stream, which is a coded file itself."""
    if stream.byte_count is not None:
        message = f"--bytes is not for streams: the size of {stream.path} is that of the file"
        raise EntryError(message)


def _state_size(entry: Entry, byte_count: int | None) -> None:
    """Replace the size of an entry's files with the stated size, if there is one.

    The files of other methods are dumps for the comparison, for example one PLY file per frame of a
    method that stores a single scene and a network.
    """
    if byte_count is not None:
        entry.info = replace(entry.info, byte_count=byte_count, is_size_stated=True)


def _is_stream(path: Path) -> bool:
    return path.is_file() and path.suffix.lower() not in (_FOURDGS_SUFFIX, PLY_SUFFIX)


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
    if path.is_file() or list_plys(path):
        return open_plys(path, source.label)
    fourdgs_files = sorted(path.glob(f"*{_FOURDGS_SUFFIX}"))
    if fourdgs_files:
        message = f"{path} is a folder: use the file {fourdgs_files[0]}, which contains all frames"
        raise EntryError(message)
    return open_renders(path, source.label, cameras)


def _open_capture(
    streams: Sequence[tuple[Path, StreamSummary]], options: ComparisonOptions
) -> Capture | None:
    """Open the capture, which must match all streams; return None if there is no capture.

    Args:
        streams: Path and summary of every stream.
        options: Options of the comparison.

    Raises:
        CaptureError: The capture cannot be read.
        MismatchError: A stream does not match the capture; the message begins with its path. Or the
            pictures cannot be downscaled by the requested factor.
    """
    if options.capture is None:
        return None
    if not streams:
        try:
            return open_capture(options.capture, CaptureOptions(downscale=options.downscale))
        except DownscaleError as error:
            raise EntryError(str(error)) from error
    captures = []
    for path, summary in streams:
        with _name_path_in_errors(path):
            capture = open_same_capture(
                summary,
                options.capture,
                stop=options.stop,
                accept_other_capture=options.accept_other_capture,
            )
        captures.append(capture)
    return captures[0]


def _list_cameras(streams: Sequence[OpenStream], capture: Capture | None) -> list[Camera]:
    """Return the cameras of the capture; without a capture, those of the first stream with cameras.

    With a capture and streams, only cameras on which no stream was trained are held out in the
    result.

    Raises:
        EntryError: Two streams have different cameras, or neither a stream nor a capture has any.
    """
    streams_with_cameras = [stream for stream in streams if stream.summary.cameras]
    for other_stream in streams_with_cameras[1:]:
        _require_equal_cameras(streams_with_cameras[0], other_stream)
    if capture is None:
        if not streams_with_cameras:
            message = (
                "no stream has cameras, so there are none on which to compare the entries"
                if streams
                else "no entry is a stream, so --capture is needed to define the cameras"
            )
            raise EntryError(message)
        return list(streams_with_cameras[0].summary.cameras)
    if not streams:
        return list(capture.cameras)
    training_names = {
        camera.name
        for stream in streams
        for camera in stream.summary.cameras
        if not camera.held_out
    }
    return [
        replace(camera, held_out=camera.name not in training_names) for camera in capture.cameras
    ]


def _require_equal_cameras(first_stream: OpenStream, other_stream: OpenStream) -> None:
    """Raise EntryError if the cameras of two streams have different names or picture sizes."""
    pairs = zip_longest(first_stream.summary.cameras, other_stream.summary.cameras)
    for camera, other_camera in pairs:
        description, other_description = _describe_camera(camera), _describe_camera(other_camera)
        if description != other_description:
            message = (
                f"{first_stream.entry.label} and {other_stream.entry.label} have different "
                f"cameras: {description} and {other_description}"
            )
            raise EntryError(message)


def _describe_camera(camera: Camera | None) -> str:
    return f"{camera.name} ({camera.width} x {camera.height})" if camera else "none"


def _choose_cameras(
    available_cameras: Sequence[Camera],
    names: Sequence[str],
    measured_streams: Sequence[OpenStream],
) -> dict[str, Camera]:
    """Return the cameras with these names; without names, the held-out cameras or all cameras.

    Raises:
        EntryError: A name is unknown; or there are no names, and no camera is held out of all
            `measured_streams`.
    """
    camera_by_name = {camera.name: camera for camera in available_cameras}
    unknown_names = [name for name in names if name not in camera_by_name]
    if unknown_names:
        message = (
            f"there is no camera {unknown_names[0]}; the cameras are {', '.join(camera_by_name)}"
        )
        raise EntryError(message)
    held_out_names = [camera.name for camera in available_cameras if camera.held_out]
    if measured_streams and not (names or held_out_names):
        message = (
            f"no camera is held out of all streams ({list_held_out(measured_streams)}): encode "
            "them with the same --held-out, or choose cameras with --camera"
        )
        raise EntryError(message)
    chosen_names = list(names) or held_out_names or list(camera_by_name)
    return {name: camera_by_name[name] for name in chosen_names}


def _find_frame_rate(streams: Sequence[OpenStream], capture: Capture | None) -> float:
    if capture is not None:
        return capture.frames_per_second
    return streams[0].summary.header.frames_per_second
