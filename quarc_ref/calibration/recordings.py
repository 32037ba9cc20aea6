"""Finds the recordings in a folder: one video or one folder of pictures per camera."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path

from quarc_ref.calibration.errors import CalibrationError, UnknownCameraError
from quarc_ref.calibration.left_out_recordings import find_left_out_recordings
from quarc_ref.datasets.arrangements import (
    Files,
    list_arrangements,
    list_single_pictures,
    open_pictures,
)
from quarc_ref.datasets.natural_order import natural_order
from quarc_ref.datasets.nested_videos import describe_nested_videos
from quarc_ref.datasets.pictures import Pictures
from quarc_ref.datasets.unsupported_files import describe_unsupported_files
from quarc_ref.wording import format_count

MIN_CAMERAS = 3
_UNSAFE_CHARACTERS = re.compile(r"[^A-Za-z0-9_-]+")


@dataclass(frozen=True, slots=True, eq=False)
class Recordings:
    """Recordings of the cameras of a rig.

    Attributes:
        names: Camera names in natural order, made of letters, digits, `_` and `-`.
        pictures: Pictures of the cameras, in the order of `names`.
        stated_frame_rate: Frame rate that the caller states; None for that of `pictures`.
        left_out: Why a recording next to these cannot be used, by the name of its camera.
    """

    names: tuple[str, ...]
    pictures: Pictures
    stated_frame_rate: float | None = None
    left_out: Mapping[str, str] = field(default_factory=dict)

    @property
    def frames_per_second(self) -> float:
        """Frame rate of all cameras."""
        return self.stated_frame_rate or self.pictures.frames_per_second

    def index(self, name: str) -> int:
        """Return the index of a camera.

        Raises:
            UnknownCameraError: No camera has this name.
        """
        if name not in self.names:
            message = f"there is no camera {name}; the cameras are {', '.join(self.names)}"
            raise UnknownCameraError(message)
        return self.names.index(name)


def find_recordings(folder: Path, frames_per_second: float | None = None) -> Recordings:
    """Find the recordings in a folder.

    Recordings are videos, folders of pictures, or pictures of a single moment, in any
    arrangement that is supported for captures.

    Args:
        folder: Folder of the recordings; it needs no poses or other files.
        frames_per_second: Frame rate of all cameras; None for that of the videos, or 30 if the
            recordings are pictures.

    Raises:
        CalibrationError: Fewer than three cameras are found, or two would get the same name.
        CaptureError: A file cannot be read, or the recordings are inconsistent.
    """
    found: tuple[str, Files] = ("", {})
    for candidate in chain(list_arrangements(folder), [("NAME.png", list_single_pictures(folder))]):
        found = max(found, candidate, key=lambda match: len(match[1]))
        if len(found[1]) >= MIN_CAMERAS:
            break
    pattern, files = found
    if len(files) < MIN_CAMERAS:
        message = (
            f"{folder} has recordings of {format_count(len(files), 'camera')}, but at least "
            f"{MIN_CAMERAS} are needed: put one video or one folder of pictures per camera into "
            f"this folder{describe_nested_videos(folder) or describe_unsupported_files(folder)}"
        )
        raise CalibrationError(message)
    names = sorted(files, key=natural_order)
    pictures = open_pictures([files[name] for name in names])
    left_out = find_left_out_recordings(folder, pattern, files)
    return Recordings(_sanitize_names(names), pictures, frames_per_second, left_out)


def _sanitize_names(names: Sequence[str]) -> tuple[str, ...]:
    """Return names that are valid in every file system and in transforms.json."""
    safe_names = tuple(_UNSAFE_CHARACTERS.sub("_", name).lstrip("-") or "camera" for name in names)
    for index, name in enumerate(safe_names):
        if name in safe_names[:index]:
            other_name = names[safe_names.index(name)]
            message = (
                f"{other_name!r} and {names[index]!r} would both be named {name}: rename one of "
                "the recordings"
            )
            raise CalibrationError(message)
    return safe_names
