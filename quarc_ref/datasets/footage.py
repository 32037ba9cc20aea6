"""What a loader reads of a layout: cameras as calibrated, pictures as they are on disk.

`open_capture` makes a `Capture` of it. The fingerprint tells two captures
apart without reading all of their pictures.
"""

import hashlib
import json
import os
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from quarc_ref.datasets.calibration import CalibratedCamera
from quarc_ref.datasets.capture import PictureSource, Points
from quarc_ref.datasets.errors import MissingFileError

USUAL_FRAMES_PER_SECOND = 30.0  # where pictures are files and nothing tells
_SAMPLE_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class CaptureFiles:
    """The files that a capture is made of.

    Attributes:
        descriptions: Poses and points: files that count byte for byte.
        pictures: Videos, or picture files of all frames: names and sizes count.
        sampled: Videos, or picture files of frame 0: their ends count as well.
    """

    descriptions: tuple[Path, ...]
    pictures: tuple[Path, ...]
    sampled: tuple[Path, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Footage:
    """A capture as it is on disk.

    Attributes:
        cameras: In the order of their names.
        frame_count: Frames that every camera has.
        frames_per_second: Of all cameras.
        points: Initial points; None to triangulate them.
        source: Pictures as they are on disk.
        files: What all this was read from.
        uneven: What is wrong with the lengths of the cameras' videos, if they
            differ; `frame_count` is the shortest one's then.
    """

    cameras: tuple[CalibratedCamera, ...]
    frame_count: int
    frames_per_second: float
    points: Points | None
    source: PictureSource
    files: CaptureFiles
    uneven: str | None = None


def natural_order(name: str) -> list[str | tuple[int, str]]:
    """Return a sort key by which `cam_2` comes before `cam_10`."""
    parts = re.split(r"0*([0-9]+)", name)
    # A number by its digits: `int` rejects thousands of them.
    return [(len(part), part) if index % 2 else part for index, part in enumerate(parts)]


def compute_fingerprint(folder: Path, files: CaptureFiles) -> str:
    """Return the SHA-256 of a capture's files, hex.

    Args:
        folder: Of the capture; names count from here on, so that it can be moved.
        files: As the loader lists them.

    Raises:
        MissingFileError: A file has gone.
    """
    digest = hashlib.sha256()
    try:
        for name, path in _sort_by_name(folder, {*files.descriptions, *files.pictures}):
            digest.update(json.dumps([name, path.stat().st_size]).encode())
        for _, path in _sort_by_name(folder, files.descriptions):
            digest.update(path.read_bytes())
        for _, path in _sort_by_name(folder, files.sampled):
            digest.update(_read_ends(path))
    except OSError as error:
        message = f"{error.filename} cannot be read: {error}"
        raise MissingFileError(message) from error
    return digest.hexdigest()


def _sort_by_name(folder: Path, paths: Iterable[Path]) -> list[tuple[str, Path]]:
    return sorted((Path(os.path.relpath(path, folder)).as_posix(), path) for path in paths)


def _read_ends(path: Path) -> bytes:
    """Return the first and the last MiB of a file, which may overlap."""
    with path.open("rb") as file:
        first = file.read(_SAMPLE_BYTES)
        file.seek(max(0, path.stat().st_size - _SAMPLE_BYTES))
        return first + file.read(_SAMPLE_BYTES)
