"""Opens Gaussians of other methods as entries: one PLY file per frame, or a `.4dgs` file."""

from collections.abc import Iterator
from pathlib import Path

from quarc_ref.decoder import Splats
from quarc_ref.evaluation.comparison.entries import PLY_KIND, EntryInfo, Label, SplatEntry
from quarc_ref.evaluation.comparison.numbered_files import sort_by_frame_number
from quarc_ref.export.errors import UnreadableFramesError
from quarc_ref.export.frames_in import open_frames
from quarc_ref.export.gaussian_ply import parse_ply

PLY_SUFFIX = ".ply"


def open_plys(folder: Path, label: Label) -> SplatEntry:
    """Open a folder with one 3DGS PLY file per frame, or the PLY file of a single frame.

    Args:
        folder: Folder of the files; the last number in a file's name is the frame's ordinal.
        label: Method and operating point.

    Raises:
        EntryError: Two files have the same frame number, or there are no files.
        OSError: The folder cannot be read.
    """
    path_by_frame = sort_by_frame_number(
        [folder] if folder.is_file() else list_plys(folder), folder
    )
    byte_count = sum(path.stat().st_size for path in path_by_frame.values())
    info = EntryInfo(PLY_KIND, tuple(path_by_frame), byte_count)
    return SplatEntry(label, info, lambda frame: _read_ply(path_by_frame[frame]))


def list_plys(folder: Path) -> list[Path]:
    """Return the PLY files of a folder, in no particular order, without hidden files.

    Raises:
        OSError: The folder cannot be read.
    """
    return [
        path
        for path in folder.iterdir()
        if path.suffix.lower() == PLY_SUFFIX
        and not path.name.startswith(".")  # such as ._frame_0000.ply on macOS
        and not path.is_fifo()
    ]


def open_fourdgs(path: Path, label: Label, frames_per_second: float) -> SplatEntry:
    """Open a `.4dgs` file; its first frame is 0, or that of a `sequence.json` that names the file.

    Args:
        path: Path of the file.
        label: Method and operating point.
        frames_per_second: Frame rate at which the file is sampled.

    Raises:
        UnreadableFramesError: The file, or its `sequence.json`, is malformed.
        ImportError: `fourdgs` is not installed.
        OSError: The file cannot be read.
    """
    frames = open_frames(path, frames_per_second)
    first_frame = frames.sidecar.first_frame
    ordinals = range(first_frame, first_frame + frames.count)
    info = EntryInfo("4dgs", tuple(ordinals), path.stat().st_size)
    splats = (frame_splats for frame_splats, _ in frames.read())
    return SplatEntry(label, info, _FrameReader(zip(ordinals, splats, strict=True)).load)


def _read_ply(path: Path) -> Splats:
    try:
        return parse_ply(path.read_bytes())
    except ValueError as error:
        message = f"{path}: {error}"
        raise UnreadableFramesError(message) from error


class _FrameReader:
    """Reads frames on demand, in ascending order.

    Args:
        frames: Ordinal and Gaussians of every frame.
    """

    def __init__(self, frames: Iterator[tuple[int, Splats]]) -> None:
        self._frames = frames

    def load(self, frame: int) -> Splats:
        return next(splats for ordinal, splats in self._frames if ordinal == frame)
