"""The training views as tensors: the only way from a capture into training.

Held-out cameras are not reachable from here.
"""

from collections.abc import Iterator

import torch
from torch import Tensor

from quarc_ref.datasets.capture import Capture
from quarc_ref.format.records import Camera


class TrainingViews:
    """The training cameras of a capture and their pictures on a device.

    Args:
        capture: Its held-out cameras are left alone.
        device: Where the pictures go.
    """

    def __init__(self, capture: Capture, device: torch.device) -> None:
        self._capture = capture
        self._device = device
        self._indices = capture.training
        self._pictures: dict[tuple[int, int], Tensor] = {}

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """The training cameras."""
        return tuple(self._capture.cameras[index] for index in self._indices)

    def picture(self, view: int, frame: int) -> Tensor:
        """Return `[H, W, 3]` float32 from 0 to 1.

        Args:
            view: Index in `cameras`.
            frame: Of the capture.
        """
        key = (view, frame)
        if key not in self._pictures:
            image = torch.from_numpy(self._capture.image(self._indices[view], frame).copy())
            self._pictures[key] = image.to(self._device).to(torch.float32) / 255
        return self._pictures[key]

    def forget_before(self, frame: int) -> None:
        """Let go of the pictures of earlier frames."""
        self._pictures = {key: value for key, value in self._pictures.items() if key[1] >= frame}

    def shuffled(self, generator: torch.Generator) -> Iterator[int]:
        """Yield views for ever, each once before any comes again."""
        while True:
            yield from torch.randperm(len(self._indices), generator=generator).tolist()


def measure_extent(cameras: tuple[Camera, ...]) -> float:
    """Return the extent of a capture as 3DGS has it: 1.1 times the cameras' radius, world units."""
    rotations = torch.tensor([camera.rotation for camera in cameras], dtype=torch.float64)
    translations = torch.tensor([camera.translation for camera in cameras], dtype=torch.float64)
    centers = -(rotations.reshape(-1, 3, 3).mT @ translations[..., None])[..., 0]
    return 1.1 * float((centers - centers.mean(dim=0)).norm(dim=1).max())
