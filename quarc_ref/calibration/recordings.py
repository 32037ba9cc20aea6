"""Finds the recordings in a folder: one video or one folder of pictures per camera."""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from quarc_ref.calibration.errors import CalibrationError, UnknownCameraError
from quarc_ref.datasets.arrangements import (
    ARRANGEMENTS,
    Files,
    list_single_pictures,
    open_pictures,
)
from quarc_ref.datasets.natural_order import natural_order
from quarc_ref.datasets.pictures import Pictures

MIN_CAMERAS = 3
_PLAIN = re.compile(r"[^A-Za-z0-9_-]+")


@dataclass(frozen=True, slots=True, eq=False)
class Recordings:
    """Recordings of the cameras of a rig.

    Attributes:
        names: Camera names in natural order, made of letters, digits, `_` and `-`.
        pictures: Pictures of the cameras, in the same order.
    """

    names: tuple[str, ...]
    pictures: Pictures

    def index(self, name: str) -> int:
        """Return the index of a camera.

        Raises:
            UnknownCameraError: There is no camera of this name.
        """
        if name not in self.names:
            message = f"there is no camera {name}; the cameras are {', '.join(self.names)}"
            raise UnknownCameraError(message)
        return self.names.index(name)

    def without(self, names: Iterable[str]) -> "Recordings":
        """Return the recordings without the named cameras."""
        left_out = set(names)
        kept = [index for index, name in enumerate(self.names) if name not in left_out]
        paths = [self.pictures.paths[index] for index in kept]
        return Recordings(
            tuple(self.names[i] for i in kept), open_pictures(paths, reject_gaps=False)
        )


def find_recordings(folder: Path) -> Recordings:
    """Find the recordings in a folder.

    Recordings are videos, folders of pictures, or pictures of a single moment, in any
    arrangement that captures have.

    Args:
        folder: Folder of the recordings; it needs neither poses nor any other file.

    Raises:
        CalibrationError: There are fewer than three cameras, or two have the same name.
        CaptureError: A file cannot be read, or the recordings are inconsistent.
    """
    listers: list[Callable[[Path], Files]] = [lister for _, lister in ARRANGEMENTS]
    found: Files = {}
    for lister in (*listers, list_single_pictures):
        found = max(found, lister(folder), key=len)
        if len(found) >= MIN_CAMERAS:
            break
    if len(found) < MIN_CAMERAS:
        message = (
            f"{folder} has recordings of {len(found)} cameras, but at least {MIN_CAMERAS} "
            "are needed: put one video or one folder of pictures per camera into it"
        )
        raise CalibrationError(message)
    ordered = sorted(found, key=natural_order)
    return Recordings(_sanitize_names(ordered), open_pictures([found[name] for name in ordered]))


def _sanitize_names(names: Sequence[str]) -> tuple[str, ...]:
    """Return names that are valid in every file system and in transforms.json."""
    plain = tuple(_PLAIN.sub("_", name).lstrip("-") or "camera" for name in names)
    for index, name in enumerate(plain):
        if name in plain[:index]:
            other = names[plain.index(name)]
            message = f"{other!r} and {names[index]!r} would both be named {name}: rename one"
            raise CalibrationError(message)
    return plain
