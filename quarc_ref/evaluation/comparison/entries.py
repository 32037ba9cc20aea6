"""Defines the entries of a comparison; an entry renders frames for cameras."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from quarc_ref.decoder import Splats
from quarc_ref.evaluation.metrics import Picture
from quarc_ref.evaluation.same_capture import MismatchError
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.pictures import render_picture

# Kinds of entries whose frames have the numbers in the names of their files.
PLY_KIND, RENDERS_KIND = "PLY per frame", "renders"
NUMBERED_KINDS = (PLY_KIND, RENDERS_KIND)


class EntryError(MismatchError):
    """An entry is unusable, or cannot be compared with the other entries."""


@dataclass(frozen=True, slots=True)
class Label:
    """The method and operating point of an entry.

    Attributes:
        method: Name of the method; all entries of a method form one rate-distortion curve.
        point: Name of the operating point; entries with the same method and point are runs with the
            same settings.
    """

    method: str
    point: str

    def __str__(self) -> str:
        """Return the label as it is written on the command line."""
        return self.method if self.method == self.point else f"{self.method}@{self.point}"


@dataclass(frozen=True, slots=True)
class EntryInfo:
    """Frames and size of an entry.

    Attributes:
        kind: Human-readable kind of the entry.
        frames: Ordinals of the frames, ascending.
        byte_count: Total size of all frames in bytes; None if unknown.
        is_size_stated: Whether the user stated the size, which no file of the entry shows.
    """

    kind: str
    frames: tuple[int, ...]
    byte_count: int | None
    is_size_stated: bool = False


class Entry(ABC):
    """Interface of the entries of a comparison.

    Args:
        label: Method and operating point.
        info: Frames and size.
    """

    def __init__(self, label: Label, info: EntryInfo) -> None:
        self.label = label
        self.info = info

    @abstractmethod
    def render(self, frame: int, cameras: Mapping[str, Camera]) -> dict[str, Picture]:
        """Render a frame for each camera.

        Args:
            frame: Ordinal of the frame; it must be greater than in all earlier calls.
            cameras: Cameras by name; a stream renders for its own cameras of these names.

        Returns:
            The `[H, W, 3]` float32 picture of each camera, from 0 to 1, by camera name.

        Raises:
            BitstreamError: A stream is malformed.
            UnreadableFramesError: A file of Gaussians is malformed.
            CaptureError: A picture is malformed or missing.
            EntryError: A picture does not have the size of its camera.
        """


class SplatEntry(Entry):
    """An entry whose frames are sets of Gaussians.

    Args:
        label: Method and operating point.
        info: Frames and size.
        load: Function that returns the Gaussians of a frame; it is called with ascending ordinals.
        own_cameras: Cameras in the world coordinates of the Gaussians, which can differ from those
            of the capture; a camera that is not listed is in the same coordinates as the Gaussians.
    """

    def __init__(
        self,
        label: Label,
        info: EntryInfo,
        load: Callable[[int], Splats],
        own_cameras: Iterable[Camera] = (),
    ) -> None:
        super().__init__(label, info)
        self._load = load
        self._own_cameras = {camera.name: camera for camera in own_cameras}

    def render(self, frame: int, cameras: Mapping[str, Camera]) -> dict[str, Picture]:
        """See `Entry.render`."""
        splats = self._load(frame)
        return {
            name: np.clip(render_picture(splats, self._own_cameras.get(name, camera)), 0, 1)
            for name, camera in cameras.items()
        }
