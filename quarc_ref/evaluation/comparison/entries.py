"""Entries of a comparison: anything that can show a frame as a camera sees it."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from quarc_ref.decoder import Splats
from quarc_ref.evaluation.metrics import Picture
from quarc_ref.evaluation.same_capture import MismatchError
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.pictures import render_picture


class EntryError(MismatchError):
    """Something that cannot be compared, or not with the rest."""


@dataclass(frozen=True, slots=True)
class Label:
    """The method and operating point of an entry.

    Attributes:
        method: Entries of one method are points of one rate-distortion curve.
        point: Entries of one point of a method are runs of the same settings.
    """

    method: str
    point: str

    def __str__(self) -> str:
        """Return it as the command line has it."""
        return self.method if self.method == self.point else f"{self.method}@{self.point}"


@dataclass(frozen=True, slots=True)
class Holdings:
    """Frames and size of an entry.

    Attributes:
        kind: Human-readable kind.
        frames: Ordinals of its frames, ascending.
        byte_count: Size of all its frames together; None if unknown.
    """

    kind: str
    frames: tuple[int, ...]
    byte_count: int | None


class Entry(ABC):
    """One thing that is compared.

    Args:
        label: Its method and operating point.
        holdings: Its frames and size.
    """

    def __init__(self, label: Label, holdings: Holdings) -> None:
        self.label = label
        self.holdings = holdings

    @abstractmethod
    def draw(self, frame: int, cameras: Mapping[str, Camera]) -> dict[str, Picture]:
        """Return what cameras see of a frame.

        Args:
            frame: One of its frames; never an earlier one than in the call before.
            cameras: By name.

        Returns:
            `[H, W, 3]` float32 from 0 to 1 for each camera, by name.

        Raises:
            BitstreamError: A stream is malformed.
            UnreadableFramesError: A file of Gaussians is malformed.
            CaptureError: A picture is malformed, missing, or of another size.
        """


class SplatEntry(Entry):
    """An entry whose frames are Gaussians.

    Args:
        label: As for `Entry`.
        holdings: As for `Entry`.
        load: Returns the Gaussians of a frame; frames are requested in ascending order.
    """

    def __init__(self, label: Label, holdings: Holdings, load: Callable[[int], Splats]) -> None:
        super().__init__(label, holdings)
        self._load = load

    def draw(self, frame: int, cameras: Mapping[str, Camera]) -> dict[str, Picture]:
        """See `Entry.draw`."""
        splats = self._load(frame)
        return {
            name: np.clip(render_picture(splats, camera), 0, 1) for name, camera in cameras.items()
        }
