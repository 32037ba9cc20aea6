"""Reads frames that other programs wrote, from a folder of files or from one file.

A folder has one PLY or SPZ file per frame, and the numbers in the file names define the order. The
optional `sequence.json`, which `decode` writes into the folder of the frames, contains the frame
rate, axes and cameras; its contents are validated.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from quarc_ref.datasets.natural_order import natural_order
from quarc_ref.decoder.dequantize import Splats
from quarc_ref.export.errors import NoFramesError, UnreadableFramesError
from quarc_ref.export.fourdgs_file import read_4dgs
from quarc_ref.export.gaussian_ply import parse_ply
from quarc_ref.export.sidecar import (
    SIDECAR_NAME,
    Sidecar,
    parse_sidecar,
    rotate_sidecar_upright,
)
from quarc_ref.export.spz import parse_spz
from quarc_ref.format.arrays import Int64

_PARSERS: dict[str, Callable[[bytes], Splats]] = {".ply": parse_ply, ".spz": parse_spz}
_FOURDGS_SUFFIX = ".4dgs"
_NUMBER_PATTERN = re.compile(r"[0-9]+")
SUFFIXES = ", ".join([*_PARSERS, _FOURDGS_SUFFIX])


@dataclass(frozen=True, slots=True)
class ImportedFrames:
    """Frames to import.

    Attributes:
        count: Number of frames.
        read: Function that yields the Gaussians of each frame and their ids `[N]`; the ids are
            None if the format has none.
        frames_per_second: Frame rate; None if unknown.
        sidecar: Contents of `sequence.json` in the axes of the frames; if there is no such file,
            default values, with the up axis if the format defines it.
        file_numbers: Last number in the name of each file in a folder; empty if a name has none.
    """

    count: int
    read: Callable[[], Iterator[tuple[Splats, Int64 | None]]]
    frames_per_second: float | None = None
    sidecar: Sidecar = field(default_factory=Sidecar)
    file_numbers: tuple[int, ...] = ()


def open_frames(path: Path, frames_per_second: float | None = None) -> ImportedFrames:
    """Open the frames of a file or folder.

    Args:
        path: A `.ply` or `.spz` file with one frame, a folder of such files, or a `.4dgs` file.
        frames_per_second: Sampling rate of a `.4dgs` file; None for the frame rate of the file.

    Raises:
        NoFramesError: The path has no frames, or frames in several formats.
        UnreadableFramesError: A frame is malformed.
        ImportError: The library for the format is not installed.
        OSError: A file cannot be read.
    """
    if path.suffix.lower() == _FOURDGS_SUFFIX:
        return _open_fourdgs(path, frames_per_second)
    paths = [path] if path.is_file() else _list_frames(path)
    suffix = paths[0].suffix.lower()
    if suffix not in _PARSERS:
        message = f"{path} is not a file with frames; supported suffixes are {SUFFIXES}"
        raise NoFramesError(message)
    sidecar = _read_sidecar(path) if path.is_dir() else Sidecar()

    def read() -> Iterator[tuple[Splats, Int64 | None]]:
        for frame_path in paths:
            with _name_file_in_errors(frame_path):
                splats = _PARSERS[suffix](frame_path.read_bytes())
            yield splats, None

    if suffix == ".spz":
        sidecar = rotate_sidecar_upright(sidecar)
    file_numbers = _list_last_numbers(paths) if path.is_dir() else ()
    return ImportedFrames(len(paths), read, sidecar.frames_per_second, sidecar, file_numbers)


def _open_fourdgs(path: Path, frames_per_second: float | None) -> ImportedFrames:
    """Open a `.4dgs` file; `sequence.json` in its folder is used if it names the file."""
    sidecar = _read_sidecar(path.parent)
    if sidecar.files != path.name:
        sidecar = Sidecar()
    with _name_file_in_errors(path):
        frames = read_4dgs(path.read_bytes(), frames_per_second or sidecar.frames_per_second)

    def read() -> Iterator[tuple[Splats, Int64 | None]]:
        with _name_file_in_errors(path):
            yield from frames.read()

    return ImportedFrames(frames.count, read, frames.frames_per_second, sidecar)


def _read_sidecar(folder: Path) -> Sidecar:
    """Read `sequence.json` in a folder; return default values if there is no such file."""
    path = folder / SIDECAR_NAME
    if not path.is_file():
        return Sidecar()
    with _name_file_in_errors(path):
        return parse_sidecar(path.read_bytes())


def _list_frames(folder: Path) -> list[Path]:
    """Return the frames of a folder in the order of their numbers.

    Raises:
        NoFramesError: The folder has no frames, or frames in several formats.
    """
    # Systems and programs write hidden files next to others, such as ._frame_0000.ply on macOS.
    # Reading a named pipe would wait for a writer forever.
    visible_paths = [
        path for path in folder.iterdir() if not path.name.startswith(".") and not path.is_fifo()
    ]
    paths = [path for path in visible_paths if path.suffix.lower() in _PARSERS]
    suffixes = sorted({path.suffix.lower() for path in paths})
    fourdgs_files = sorted(path for path in visible_paths if path.suffix.lower() == _FOURDGS_SUFFIX)
    if not suffixes and fourdgs_files:
        message = (
            f"{folder} is a folder: use the file {fourdgs_files[0]}, which contains all frames"
        )
        raise NoFramesError(message)
    if len(suffixes) != 1:
        formats = f"both {' and '.join(suffixes)}" if suffixes else f"no {' or '.join(_PARSERS)}"
        message = (
            f"{folder} has {formats} files, but must have one file per frame, all in one format"
        )
        raise NoFramesError(message)
    return sorted(sorted(paths), key=lambda path: natural_order(path.stem))


def _list_last_numbers(paths: Sequence[Path]) -> tuple[int, ...]:
    numbers = [_NUMBER_PATTERN.findall(path.stem) for path in paths]
    return tuple(int(number) for *_, number in numbers) if all(numbers) else ()


@contextmanager
def _name_file_in_errors(path: Path) -> Iterator[None]:
    """Convert a ValueError to an UnreadableFramesError that names the file."""
    try:
        yield
    except ValueError as error:
        message = f"{path}: {error}"
        raise UnreadableFramesError(message) from error
