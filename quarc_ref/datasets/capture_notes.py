"""The properties of a capture in `quarc-capture.json`, which no capture layout can store.

The file is in the folder of a capture, next to the files of the capture's layout:

    {"offsets": {"cam03": 4, "cam07": 0.5}, "frames_per_second": 25, "up": [0, -1, 0],
     "meters_per_unit": 1, "background": "transparent", "ignored_frames": {"cam03": [[300, 420]]}}

Every key is optional. `calibrate` writes the file. Loading a capture applies the offsets, the frame
rate, the background and the ignored frames, and encoding writes the up direction and the scale into
the stream.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from quarc_ref.datasets.errors import MissingCameraError
from quarc_ref.datasets.ignored_frames import IgnoredFrames
from quarc_ref.format.frame_rate import MAX_FRAME_RATE, MIN_FRAME_RATE, is_frame_rate

NOTES_NAME = "quarc-capture.json"
_MAX_OFFSET = 1e7  # largest offset: a day at 100 frames per second
_MAX_METERS_PER_UNIT = 1e6  # largest `meters_per_unit`, as in the header of a stream (SPEC 5.3)

Direction = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class CaptureNotes:
    """Time offsets, frame rate, up direction, scale, background and ignored frames of a capture.

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
        ignored_frames: Frames of single cameras that are not used.

    Raises:
        ValueError: A number is not finite or out of range.
    """

    offsets: Mapping[str, float] = field(default_factory=dict)
    up: Direction | None = None
    meters_per_unit: float | None = None
    frames_per_second: float | None = None
    has_transparent_background: bool = False
    ignored_frames: IgnoredFrames = field(default_factory=IgnoredFrames)

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


def _normalize_direction(up: Direction) -> Direction:
    largest = max(map(abs, up))
    if not (all(map(math.isfinite, up)) and largest > 0):
        message = f"'up' is {list(up)}; it must consist of finite numbers that are not all 0"
        raise ValueError(message)
    x, y, z = (number / largest for number in up)  # scaled so that no square overflows
    length = math.hypot(x, y, z)
    return x / length, y / length, z / length
