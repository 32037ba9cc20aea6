"""The recordings in a folder: one video, or one folder of pictures, to a camera."""

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

LEAST_CAMERAS = 3
_PLAIN = re.compile(r"[^A-Za-z0-9_-]+")


@dataclass(frozen=True, slots=True, eq=False)
class Recordings:
    """Recordings of the cameras of a rig.

    Attributes:
        names: Names of the cameras, in natural order, of letters, digits, `_` and `-`.
        pictures: `[camera]` in the same order.
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

    def leave_out(self, names: Iterable[str]) -> "Recordings":
        """Return the recordings without some cameras."""
        left_out = set(names)
        kept = [index for index, name in enumerate(self.names) if name not in left_out]
        paths = [self.pictures.paths[index] for index in kept]
        return Recordings(tuple(self.names[i] for i in kept), open_pictures(paths, numbered=False))


def find_recordings(folder: Path) -> Recordings:
    """Return the recordings in a folder.

    They are videos, folders of pictures, or pictures of one moment, in any arrangement of
    captures.

    Args:
        folder: Folder of the recordings; it needs neither poses nor any other file.

    Raises:
        CalibrationError: There are not three cameras, or two of the same name.
        CaptureError: A file cannot be read, or the recordings do not fit together.
    """
    listers: list[Callable[[Path], Files]] = [lister for _, lister in ARRANGEMENTS]
    found: Files = {}
    for lister in (*listers, list_single_pictures):
        found = max(found, lister(folder), key=len)
        if len(found) >= LEAST_CAMERAS:
            break
    if len(found) < LEAST_CAMERAS:
        message = (
            f"{folder} has recordings of {len(found)} cameras, and at least {LEAST_CAMERAS} are "
            "needed: put one video of each camera into it, or one folder of pictures"
        )
        raise CalibrationError(message)
    ordered = sorted(found, key=natural_order)
    return Recordings(_name_plainly(ordered), open_pictures([found[name] for name in ordered]))


def _name_plainly(names: Sequence[str]) -> tuple[str, ...]:
    """Return names that are valid in any file system and any description."""
    plain = tuple(_PLAIN.sub("_", name).lstrip("-") or "camera" for name in names)
    for index, name in enumerate(plain):
        if name in plain[:index]:
            other = names[plain.index(name)]
            message = f"{other!r} and {names[index]!r} would both be named {name}: rename one"
            raise CalibrationError(message)
    return plain
