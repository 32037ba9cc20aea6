"""Reads frames of other programs from a folder of files or from one file.

A folder has a PLY or SPZ file per frame, ordered by the numbers in their names. The
optional `sequence.json`, as written by `decode`, has frame rate, axes and cameras; its
contents are validated.
"""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.export.errors import NoFramesError, UnreadableFramesError
from quarc_ref.export.fourdgs_file import read_4dgs
from quarc_ref.export.gaussian_ply import parse_ply
from quarc_ref.export.sidecar import NAME, Sidecar, parse_sidecar
from quarc_ref.export.spz import UP_AXIS as SPZ_UP_AXIS
from quarc_ref.export.spz import parse_spz
from quarc_ref.format.arrays import Int64

_PARSERS: dict[str, Callable[[bytes], Splats]] = {".ply": parse_ply, ".spz": parse_spz}
_WHOLE = ".4dgs"
_NUMBER = re.compile(r"(\d+)")
KINDS = ", ".join([*_PARSERS, _WHOLE])


@dataclass(frozen=True, slots=True)
class FramesIn:
    """Frames to import.

    Attributes:
        count: Number of frames.
        read: Function that yields the Gaussians of each frame and their ids `[N]`, or
            None without ids.
        frames_per_second: Frame rate; None if it is not given.
        sidecar: Contents of `sequence.json`; defaults if there is none.
        up_axis: Up axis as in a stream's header if the format defines it, else 0.
    """

    count: int
    read: Callable[[], Iterator[tuple[Splats, Int64 | None]]]
    frames_per_second: float | None = None
    sidecar: Sidecar = field(default_factory=Sidecar)
    up_axis: int = 0


def open_frames(path: Path, frames_per_second: float | None = None) -> FramesIn:
    """Open the frames of a file or folder.

    Args:
        path: A `.ply` or `.spz` file with one frame, a folder of such files, or a `.4dgs` file.
        frames_per_second: Sampling rate of a `.4dgs` file; None for its own frame rate.

    Raises:
        NoFramesError: There are no frames, or frames of several formats.
        UnreadableFramesError: A frame is malformed.
        ImportError: The library for the format is not installed.
        OSError: A file cannot be read.
    """
    if path.suffix.lower() == _WHOLE:
        with _name_file_in_errors(path):
            whole = read_4dgs(path.read_bytes(), frames_per_second)

        def read_single() -> Iterator[tuple[Splats, Int64 | None]]:
            with _name_file_in_errors(path):
                yield from whole.read()

        return FramesIn(whole.count, read_single, whole.frames_per_second)
    paths = [path] if path.is_file() else _list_frames(path)
    kind = paths[0].suffix.lower()
    if kind not in _PARSERS:
        message = f"{path} is not a {KINDS} file"
        raise NoFramesError(message)
    beside = (path if path.is_dir() else path.parent) / NAME
    sidecar = Sidecar()
    if path.is_dir() and beside.is_file():
        with _name_file_in_errors(beside):
            sidecar = parse_sidecar(beside.read_bytes())

    def read() -> Iterator[tuple[Splats, Int64 | None]]:
        for each in paths:
            with _name_file_in_errors(each):
                splats = _PARSERS[kind](each.read_bytes())
            yield splats, None

    up_axis = SPZ_UP_AXIS if kind == ".spz" else 0
    return FramesIn(len(paths), read, sidecar.frames_per_second, sidecar, up_axis)


def _list_frames(folder: Path) -> list[Path]:
    """Return the frames of a folder in the order of their numbers.

    Raises:
        NoFramesError: There are no frames, or frames of several formats.
    """
    paths = [path for path in folder.iterdir() if path.suffix.lower() in _PARSERS]
    kinds = sorted({path.suffix.lower() for path in paths})
    whole = sorted(folder.glob(f"*{_WHOLE}"))
    if not kinds and whole:
        message = f"{folder} is a folder: name the file in it, {whole[0]}, which has all frames"
        raise NoFramesError(message)
    if len(kinds) != 1:
        found = f"both {' and '.join(kinds)}" if kinds else f"no {' or '.join(_PARSERS)}"
        message = f"{folder} has {found} files; it must have files of one format, one per frame"
        raise NoFramesError(message)
    return sorted(paths, key=_list_numbered)


def _list_numbered(path: Path) -> list[tuple[int, str]]:
    parts = _NUMBER.split(path.stem)
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]


@contextmanager
def _name_file_in_errors(path: Path) -> Iterator[None]:
    """Convert a ValueError to an UnreadableFramesError that names the file."""
    try:
        yield
    except ValueError as error:
        message = f"{path}: {error}"
        raise UnreadableFramesError(message) from error
