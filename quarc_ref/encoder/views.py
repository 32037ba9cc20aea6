"""The training views as tensors: the only way from a capture into training.

Held-out cameras are not reachable from here.
"""

from collections.abc import Iterator
from dataclasses import replace

import torch
from torch import Tensor

from quarc_ref.datasets.capture import Capture
from quarc_ref.format.records import Camera


class TrainingViews:
    """The training cameras of a capture and their pictures on a device.

    Args:
        capture: Its held-out cameras are left alone.
        device: Where the pictures go.
        shrink: Pixels along each side of a square that becomes one pixel; what
            is left over at the right and at the bottom is cut off.
    """

    def __init__(self, capture: Capture, device: torch.device, shrink: int = 1) -> None:
        self._capture = capture
        self._device = device
        self._shrink = shrink
        self._indices = capture.training
        self._cameras = tuple(_shrunk(capture.cameras[index], shrink) for index in self._indices)
        self._pictures: dict[tuple[int, int], Tensor] = {}

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """The training cameras, as they see the pictures."""
        return self._cameras

    def picture(self, view: int, frame: int) -> Tensor:
        """Return `[H, W, 3]` float32 from 0 to 1.

        Args:
            view: Index in `cameras`.
            frame: Of the capture.
        """
        key = (view, frame)
        if key not in self._pictures:
            image = torch.from_numpy(self._capture.image(self._indices[view], frame).copy())
            picture = image.to(self._device).to(torch.float32) / 255
            self._pictures[key] = _average(picture, self._shrink)
        return self._pictures[key]

    def halved(self) -> "TrainingViews":
        """Return the same views in half the width and half the height."""
        return TrainingViews(self._capture, self._device, 2 * self._shrink)

    def forget_before(self, frame: int) -> None:
        """Let go of the pictures of earlier frames."""
        self._pictures = {key: value for key, value in self._pictures.items() if key[1] >= frame}

    def shuffled(self, generator: torch.Generator) -> Iterator[int]:
        """Yield views for ever, each once before any comes again."""
        while True:
            yield from torch.randperm(len(self._indices), generator=generator).tolist()


def _shrunk(camera: Camera, shrink: int) -> Camera:
    """Return a camera whose pixels are `shrink` times as wide and high."""
    return replace(
        camera,
        width=camera.width // shrink,
        height=camera.height // shrink,
        fx=camera.fx / shrink,
        fy=camera.fy / shrink,
        cx=camera.cx / shrink,
        cy=camera.cy / shrink,
    )


def _average(picture: Tensor, shrink: int) -> Tensor:
    """Return the means of squares of `shrink` pixels a side."""
    if shrink == 1:
        return picture
    means = torch.nn.functional.avg_pool2d(picture.permute(2, 0, 1), shrink)
    return means.permute(1, 2, 0).contiguous()


def measure_extent(cameras: tuple[Camera, ...]) -> float:
    """Return the extent of a capture as 3DGS has it: 1.1 times the cameras' radius, world units."""
    rotations = torch.tensor([camera.rotation for camera in cameras], dtype=torch.float64)
    translations = torch.tensor([camera.translation for camera in cameras], dtype=torch.float64)
    centers = -(rotations.reshape(-1, 3, 3).mT @ translations[..., None])[..., 0]
    return 1.1 * float((centers - centers.mean(dim=0)).norm(dim=1).max())
