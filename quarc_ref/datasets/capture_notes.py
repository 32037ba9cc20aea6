"""Reads and writes `quarc-capture.json`, a file for properties that no capture layout can store.

The file is in the folder of a capture, next to the files of the capture's layout:

    {"offsets": {"cam03": 4, "cam07": 0.5}, "frames_per_second": 25, "up": [0, -1, 0],
     "meters_per_unit": 1, "background": "transparent"}

Every key is optional. `calibrate` writes the file. Loading a capture applies the offsets, the
frame rate and the background, and encoding writes the up direction and the scale into the stream.
"""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

from quarc_ref.datasets.errors import MissingCameraError, MissingFileError, UnreadableNotesError
from quarc_ref.files import write_file
from quarc_ref.format.frame_rate import MAX_FRAME_RATE, MIN_FRAME_RATE, is_frame_rate

NOTES_NAME = "quarc-capture.json"
_KEYS = ("offsets", "frames_per_second", "up", "meters_per_unit", "background")
_BACKGROUNDS = {"opaque": False, "transparent": True}
_MAX_BYTES = 1 << 20
_MAX_OFFSET = 1e7  # largest offset: a day at 100 frames per second
_MAX_METERS_PER_UNIT = 1e6  # largest `meters_per_unit`, as in the header of a stream (SPEC 5.3)

Direction = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class CaptureNotes:
    """Time offsets, frame rate, up direction, scale and background of a capture.

    Attributes:
        offsets: Offsets in frames by camera name: frame `t` of the capture is frame
            `t + offset` of the camera's recording. Cameras that are not listed have an
            offset of 0. Only differences between offsets matter.
        up: Unit vector that points up in the world; None if the up direction is unknown.
        meters_per_unit: Size of a world unit; None if it is unknown.
        frames_per_second: Frame rate of all cameras; None for the one that the videos state.
            Folders of pictures state none.
        has_transparent_background: Whether the scene consists only of what the masks, or the
            alpha channels of the pictures, cover.

    Raises:
        ValueError: A number is not finite or out of range.
    """

    offsets: Mapping[str, float] = field(default_factory=dict)
    up: Direction | None = None
    meters_per_unit: float | None = None
    frames_per_second: float | None = None
    has_transparent_background: bool = False

    def __post_init__(self) -> None:
        for name, offset in self.offsets.items():
            if not abs(offset) <= _MAX_OFFSET:
                message = (
                    f"the offset of camera {name} is {offset}; it must be between "
                    f"{-_MAX_OFFSET:,.0f} and {_MAX_OFFSET:,.0f} frames"
                )
                raise ValueError(message)
        if self.up is not None:
            object.__setattr__(self, "up", _normalize_direction(self.up))
        if (
            self.meters_per_unit is not None
            and not 0 < self.meters_per_unit <= _MAX_METERS_PER_UNIT
        ):
            message = (
                f"meters_per_unit is {self.meters_per_unit}; it must be above 0 and at most 1000000"
            )
            raise ValueError(message)

        rate = self.frames_per_second
        if rate is not None and not is_frame_rate(rate):
            message = (
                f"frames_per_second is {rate}; it must be from {MIN_FRAME_RATE:g} to "
                f"{MAX_FRAME_RATE:,.0f}"
            )
            raise ValueError(message)

    def first_frames(self, cameras: Iterable[str]) -> dict[str, int]:
        """Return, by camera name, the frame of the camera's recording that becomes frame 0.

        Only differences of offsets matter: all offsets are shifted by the same fraction of a frame,
        so that the largest rounding error is as small as possible, then rounded, and shifted so
        that the smallest is 0.

        Args:
            cameras: Names of all cameras of the capture, at least one.

        Raises:
            MissingCameraError: There is an offset for an unknown camera.
        """
        names = list(cameras)
        unknown_names = sorted(set(self.offsets) - set(names))
        if unknown_names:
            message = (
                f"{NOTES_NAME} has offsets for cameras that are not in the capture: "
                f"{', '.join(unknown_names)}; the cameras are {', '.join(names)}"
            )
            raise MissingCameraError(message)
        offsets = [self.offsets.get(name, 0.0) for name in names]
        fraction = _find_common_fraction(offsets)
        rounded_offsets = [math.floor(offset - fraction + 0.5) for offset in offsets]
        smallest_offset = min(rounded_offsets)
        return {
            name: offset - smallest_offset
            for name, offset in zip(names, rounded_offsets, strict=True)
        }


def _find_common_fraction(offsets: Sequence[float]) -> float:
    """Return the shift, as a fraction of a frame, with the smallest largest rounding error.

    On a circle with a circumference of one frame, the fractions of all offsets are closest to the
    point that is opposite to the middle of the largest gap between them.
    """
    fractions = sorted(offset % 1.0 for offset in offsets)
    gaps = [second - first for first, second in pairwise([*fractions, fractions[0] + 1])]
    largest = gaps.index(max(gaps))
    return (fractions[largest] + gaps[largest] / 2 + 0.5) % 1.0


def read_capture_notes(folder: Path) -> CaptureNotes:
    """Read `quarc-capture.json` in the folder of a capture; return empty notes if it is missing.

    Args:
        folder: Folder of the capture.

    Raises:
        MissingFileError: The file exists but cannot be read.
        UnreadableNotesError: The file is malformed.
    """
    path = folder / NOTES_NAME
    if not path.is_file():
        return CaptureNotes()
    try:
        with path.open("rb") as file:
            data = file.read(_MAX_BYTES + 1)
        return _parse_notes(data)
    except OSError as error:
        raise MissingFileError.of(path, error) from error
    except (OverflowError, RecursionError, TypeError, ValueError) as error:
        message = f"{path}: {error}"
        raise UnreadableNotesError(message) from error


def write_capture_notes(path: Path, notes: CaptureNotes) -> None:
    """Write notes to a file, replacing an existing file.

    Args:
        path: Path of the file; the file name must be `NOTES_NAME`.
        notes: Notes to write; unknown values are omitted.

    Raises:
        OSError: The file cannot be written.
    """
    document: dict[str, object] = {"offsets": dict(notes.offsets)}
    if notes.up is not None:
        document["up"] = list(notes.up)
    if notes.meters_per_unit is not None:
        document["meters_per_unit"] = notes.meters_per_unit
    if notes.frames_per_second is not None:
        document["frames_per_second"] = notes.frames_per_second
    if notes.has_transparent_background:
        document["background"] = "transparent"
    write_file(path, json.dumps(document, indent=2, allow_nan=False).encode() + b"\n")


def _parse_notes(data: bytes) -> CaptureNotes:
    if len(data) > _MAX_BYTES:
        message = f"the file has more than {_MAX_BYTES:,} bytes"
        raise ValueError(message)
    document = json.loads(data)
    if not isinstance(document, dict):
        message = "the file is not a JSON object"
        raise TypeError(message)
    unknown_keys = sorted(set(document) - set(_KEYS))
    if unknown_keys:
        message = (
            f"unknown keys: {', '.join(map(repr, unknown_keys))}; the known keys are "
            f"{', '.join(_KEYS)}"
        )
        raise ValueError(message)
    offsets = document.get("offsets", {})
    if not isinstance(offsets, dict):
        message = "'offsets' is not an object that maps cameras to frames"
        raise TypeError(message)
    meters_per_unit, frames_per_second = (
        _parse_number(document[key], key) if key in document else None
        for key in ("meters_per_unit", "frames_per_second")
    )
    return CaptureNotes(
        {name: _parse_number(offset, f"the offset of {name}") for name, offset in offsets.items()},
        _parse_up(document["up"]) if "up" in document else None,
        meters_per_unit,
        frames_per_second,
        _parse_background(document.get("background", "opaque")),
    )


def _parse_background(value: object) -> bool:
    if not isinstance(value, str) or value not in _BACKGROUNDS:
        message = f"'background' is not one of {', '.join(map(repr, _BACKGROUNDS))}"
        raise ValueError(message)
    return _BACKGROUNDS[value]


def _parse_up(value: object) -> Direction:
    if not isinstance(value, list) or len(value) != 3:
        message = "'up' is not a list of three numbers"
        raise TypeError(message)
    x, y, z = (_parse_number(number, "'up'") for number in value)
    return x, y, z


def _parse_number(value: object, label: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        message = f"{label} is not a number"
        raise TypeError(message)
    return float(value)


def _normalize_direction(up: Direction) -> Direction:
    largest = max(map(abs, up))
    if not (all(map(math.isfinite, up)) and largest > 0):
        message = f"'up' is {list(up)}; it must consist of finite numbers that are not all 0"
        raise ValueError(message)
    x, y, z = (number / largest for number in up)  # scaled so that no square overflows
    length = math.hypot(x, y, z)
    return x / length, y / length, z / length
