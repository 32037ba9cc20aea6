"""A capture: calibrated cameras and their pictures in every frame.

`open_capture` converts the output of a loader in `layouts` to a `Capture`, so that the encoder
and the evaluation do not depend on the layout. Pictures are decoded on demand and kept in a
cache of limited size.
"""

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.capture_notes import CaptureNotes
from quarc_ref.datasets.errors import TooFewFramesError
from quarc_ref.datasets.findings import Finding
from quarc_ref.format.cameras import Camera

Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]
Alpha = NDArray[np.uint8]
_MAX_CACHE_BYTES = 1 << 28
_NO_NOTES = CaptureNotes()


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Initial points of a scene.

    Attributes:
        positions: `[P, 3]` positions, world units.
        colors: `[P, 3]` sRGB colors, 0 to 255.
    """

    positions: NDArray[np.float32]
    colors: NDArray[np.uint8]


def require_finite(positions: NDArray[np.float32]) -> None:
    """Raise ValueError if the position `[P, 3]` of a point is not finite."""
    invalid_rows = np.flatnonzero(~np.isfinite(positions).all(axis=1))
    if invalid_rows.size:
        row = int(invalid_rows[0])
        text = ", ".join(f"{number:g}" for number in positions[row])
        message = (
            f"{invalid_rows.size} of {len(positions)} points have positions that are not finite, "
            f"the first of them point {row} ({text}): remove these points"
        )
        raise ValueError(message)


def join_points(parts: Sequence[Points]) -> Points:
    """Concatenate one or more sets of points."""
    positions: NDArray[np.float32] = np.concatenate([part.positions for part in parts])
    return Points(positions, np.concatenate([part.colors for part in parts]))


class PictureSource(Protocol):
    """Interface for reading the pictures of a capture."""

    def read(self, camera: int, frame: int) -> Image:
        """Return a picture, `[H, W, 3]` sRGB, as a new array.

        Raises:
            CaptureError: The picture cannot be read.
        """
        ...


class MaskSource(Protocol):
    """Interface for reading the masks of a capture."""

    def read(self, camera: int, frame: int) -> Mask | None:
        """Return the `[H, W]` mask, true for pixels to use; return None if all are used.

        Raises:
            CaptureError: The mask cannot be read.
        """
        ...


class AlphaSource(Protocol):
    """Interface for reading how much of each pixel a subject covers."""

    def read(self, camera: int, frame: int) -> Alpha:
        """Return the `[H, W]` alpha of a picture, from 0 (transparent) to 255 (opaque).

        Raises:
            CaptureError: The alpha cannot be read.
        """
        ...


class Capture:
    """Multi-view video of one scene.

    Args:
        name: Name of the capture in reports.
        cameras: Undistorted cameras in the order of their names.
        frame_count: Number of frames that every camera has.
        frames_per_second: Frame rate of all cameras.
        points: Initial points of the scene at frame 0.
        source: Source of the pictures. Transparent pixels are black in them.
        fingerprint: Hex digest that identifies the capture's files.
        max_cache_bytes: Maximum size of the picture cache, bytes.
        full_capture: The whole capture, if this capture is only a part of it; otherwise None.
        findings: Problems that the loader found, and assumptions that it made.
        start: Frame of the synchronized recording that becomes frame 0 of the capture.
        notes: Up direction and scale of the scene, and frames of single cameras that are ignored.
        masks: Source of the masks; None if all pixels are used.
        alphas: Source of the alpha of the pictures; None if they are opaque.
        stored_pictures: The pictures before they are undistorted and downscaled; None if they are
            not known.
    """

    def __init__(  # noqa: PLR0913, a capture has this many parts
        self,
        name: str,
        cameras: Sequence[Camera],
        frame_count: int,
        frames_per_second: float,
        points: Points,
        source: PictureSource,
        fingerprint: str,
        max_cache_bytes: int = _MAX_CACHE_BYTES,
        full_capture: "Capture | None" = None,
        findings: Sequence[Finding] = (),
        start: int = 0,
        notes: CaptureNotes = _NO_NOTES,
        masks: MaskSource | None = None,
        alphas: AlphaSource | None = None,
        stored_pictures: PictureSource | None = None,
    ) -> None:
        self.name = name
        self.cameras = tuple(cameras)
        self.frame_count = frame_count
        self.frames_per_second = frames_per_second
        self.points = points
        self.fingerprint = fingerprint
        self.findings = tuple(findings)
        self.start = start
        self.notes = notes
        self.full_capture = full_capture or self
        self.masks = masks
        self.alphas = alphas
        self.stored_pictures = stored_pictures
        self._source = source
        self._cache: OrderedDict[tuple[int, int], Image] = OrderedDict()
        self._max_cache_bytes = max_cache_bytes

    @property
    def training(self) -> tuple[int, ...]:
        """Indices of the training cameras."""
        return tuple(i for i, camera in enumerate(self.cameras) if not camera.held_out)

    @property
    def held_out(self) -> tuple[int, ...]:
        """Indices of the cameras held out for evaluation."""
        return tuple(i for i, camera in enumerate(self.cameras) if camera.held_out)

    def is_used(self, camera: int, frame: int) -> bool:
        """Return whether a picture is used: the notes may ignore frames of single cameras."""
        name = self.cameras[camera].name
        return not self.notes.ignored_frames.contains(name, self.start + frame)

    def training_at(self, frame: int) -> tuple[int, ...]:
        """Indices of the training cameras whose picture of a frame is used."""
        return tuple(index for index in self.training if self.is_used(index, frame))

    def require_frames(self, requested_count: int | None) -> int:
        """Return the number of frames to use.

        Args:
            requested_count: Requested number of frames; None for all.

        Raises:
            TooFewFramesError: The capture has fewer frames than requested.
        """
        if requested_count is None:
            return self.frame_count
        if not 1 <= requested_count <= self.frame_count:
            message = (
                f"{requested_count} frames are requested, but capture {self.name} has "
                f"{self.frame_count}{f' from frame {self.start} on' if self.start else ''}"
            )
            raise TooFewFramesError(message)
        return requested_count

    def image(self, camera: int, frame: int) -> Image:
        """Return a picture, `[H, W, 3]` sRGB, read-only; it is black if it is not used.

        Raises:
            CaptureError: The picture cannot be read.
            ValueError: The frame does not exist.
        """
        if not 0 <= frame < self.frame_count:
            message = f"frame {frame} is not among the {self.frame_count} frames of the capture"
            raise ValueError(message)
        key = (camera, frame)
        if key not in self._cache:
            picture = self._read(camera, frame)
            picture.setflags(write=False)
            self._cache[key] = picture
        self._cache.move_to_end(key)
        while len(self._cache) > 1 and self._count_cached_bytes() > self._max_cache_bytes:
            self._cache.popitem(last=False)
        return self._cache[key]

    def mask(self, camera: int, frame: int) -> Mask | None:
        """Return the `[H, W]` mask of a picture, true for pixels to use; None if all are used.

        Raises:
            CaptureError: The mask cannot be read.
        """
        if not self.is_used(camera, frame):
            return np.zeros(self._shape(camera), dtype=bool)
        return None if self.masks is None else self.masks.read(camera, frame)

    def alpha(self, camera: int, frame: int) -> Alpha | None:
        """Return the `[H, W]` alpha of a picture, 0 to 255; None if the capture is opaque.

        Raises:
            CaptureError: The alpha cannot be read.
        """
        if self.alphas is None:
            return None
        if not self.is_used(camera, frame):
            return np.zeros(self._shape(camera), dtype=np.uint8)
        return self.alphas.read(camera, frame)

    def _read(self, camera: int, frame: int) -> Image:
        if not self.is_used(camera, frame):
            return np.zeros((*self._shape(camera), 3), dtype=np.uint8)
        return self._source.read(camera, frame)

    def _shape(self, camera: int) -> tuple[int, int]:
        return self.cameras[camera].height, self.cameras[camera].width

    def _count_cached_bytes(self) -> int:
        return sum(picture.nbytes for picture in self._cache.values())
