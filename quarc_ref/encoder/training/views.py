"""The training views as tensors: the only pictures of a capture that training uses.

`TrainingViews` gives no access to held-out cameras.
"""

from collections.abc import Iterator, Sequence

import torch
from torch import Tensor

from quarc_ref.datasets.calibration import DownscaleError, downscale_camera
from quarc_ref.datasets.capture import Alpha, Capture, Mask
from quarc_ref.format.cameras import Camera
from quarc_ref.format.errors import EncodeError

# Powers of 1/x, where x^4 = x + 1: the fractions of their multiples fill the color cube evenly.
_COLOR_STEPS = (0.8191725134, 0.6710436067, 0.5497004779)


class TrainingViews:
    """The training cameras of a capture and their pictures on a device.

    Args:
        capture: Capture; its held-out cameras are not used.
        device: Device that holds the pictures.
        downscale: Integer factor by which width and height are reduced. Source pixels at
            the right and bottom edges are dropped if they do not fill a square of `downscale`
            x `downscale` pixels.

    Raises:
        DownscaleError: The downscaled pictures would have no pixels.
    """

    def __init__(self, capture: Capture, device: torch.device, downscale: int = 1) -> None:
        self._capture = capture
        self._device = device
        self._downscale = downscale
        self._indices = capture.training
        self._cameras = tuple(
            downscale_camera(capture.cameras[index], downscale) for index in self._indices
        )
        self._extent = measure_extent(self._cameras)
        self._backgrounds = _choose_backgrounds(capture, len(self._indices)).to(device)
        self._pictures: dict[tuple[int, int], Tensor] = {}
        self._masks: dict[tuple[int, int], Tensor | None] = {}
        self._alphas: dict[tuple[int, int], Tensor | None] = {}
        self._halved: TrainingViews | None = None

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """The training cameras with intrinsics for the downscaled pictures."""
        return self._cameras

    @property
    def device(self) -> torch.device:
        """Device that holds the pictures."""
        return self._device

    @property
    def extent(self) -> float:
        """Extent of the capture in world units (`measure_extent`)."""
        return self._extent

    def picture(self, view: int, frame: int) -> Tensor:
        """Return the `[H, W, 3]` float32 picture of a view, 0 to 1.

        Masked pixels are black; transparent pixels have the view's background color.

        Args:
            view: Index in `cameras`.
            frame: Ordinal of the frame in the capture.
        """
        key = (view, frame)
        if key not in self._pictures:
            image = torch.from_numpy(self._capture.image(self._indices[view], frame).copy())
            picture = image.to(self._device).to(torch.float32) / 255
            picture, mask = average_squares(picture, self._downscale), self.mask(view, frame)
            alpha = self.alpha(view, frame)
            if alpha is not None:
                picture = picture + (1 - alpha) * self.background(view)
            self._pictures[key] = picture if mask is None else picture * mask
        return self._pictures[key]

    def mask(self, view: int, frame: int) -> Tensor | None:
        """Return the `[H, W, 1]` mask of a view: 1 for pixels that training uses, else 0.

        Args:
            view: Index in `cameras`.
            frame: Ordinal of the frame in the capture.

        Returns:
            The mask; None if all pixels are used. A downscaled pixel is used if all its
            source pixels are used.
        """
        key = (view, frame)
        if key not in self._masks:
            source_mask = self._capture.mask(self._indices[view], frame)
            self._masks[key] = None if source_mask is None else self._downscale_mask(source_mask)
        return self._masks[key]

    def _downscale_mask(self, source_mask: Mask) -> Tensor:
        mask = torch.from_numpy(source_mask[..., None]).to(self._device, torch.float32)
        return average_squares(mask, self._downscale).floor()

    def alpha(self, view: int, frame: int) -> Tensor | None:
        """Return the `[H, W, 1]` alpha of a view, 0 to 1; None if the capture is opaque.

        Args:
            view: Index in `cameras`.
            frame: Ordinal of the frame in the capture.
        """
        key = (view, frame)
        if key not in self._alphas:
            source = self._capture.alpha(self._indices[view], frame)
            self._alphas[key] = None if source is None else self._downscale_alpha(source)
        return self._alphas[key]

    def _downscale_alpha(self, source_alpha: Alpha) -> Tensor:
        alpha = torch.from_numpy(source_alpha[..., None]).to(self._device, torch.float32) / 255
        return average_squares(alpha, self._downscale)

    def background(self, view: int) -> Tensor:
        """Return the `[3]` background color of a view's pictures; black if the capture is opaque.

        Each view has a different color. With the same color in all views, Gaussians of that color
        could cover the background.
        """
        return self._backgrounds[view]

    def halved(self) -> "TrainingViews":
        """Return the same views with half the width and height.

        They are cached until frames are dropped, so that the scenes of an ensemble share them.

        Raises:
            EncodeError: The pictures of a camera have a width or height of one pixel.
        """
        if self._halved is None:
            try:
                self._halved = TrainingViews(self._capture, self._device, 2 * self._downscale)
            except DownscaleError as error:
                message = f"{error}: use larger pictures, or canonical.half_resolution_until_iter=0"
                raise EncodeError(message) from error
        return self._halved

    def drop_frames_before(self, frame: int) -> None:
        """Remove the pictures, masks and alpha of frames before `frame` from the cache."""
        self._halved = None
        self._pictures = {key: value for key, value in self._pictures.items() if key[1] >= frame}
        self._masks = {key: value for key, value in self._masks.items() if key[1] >= frame}
        self._alphas = {key: value for key, value in self._alphas.items() if key[1] >= frame}

    def used_at(self, frame: int) -> tuple[int, ...]:
        """Return the views whose picture of a frame is used (`Capture.is_used`), at least one."""
        return tuple(
            view for view, index in enumerate(self._indices) if self._capture.is_used(index, frame)
        )

    def shuffled_indices(self, generator: torch.Generator, frame: int) -> "ShuffledIndices":
        """Return an endless iterator, in random order, over the views that are used in a frame."""
        return ShuffledIndices(self.used_at(frame), generator)


def _choose_backgrounds(capture: Capture, view_count: int) -> Tensor:
    """Return the `[V, 3]` background colors of the views."""
    if capture.alphas is None:
        return torch.zeros(view_count, 3)
    return torch.outer(torch.arange(1.0, view_count + 1), torch.tensor(_COLOR_STEPS)).frac()


class ShuffledIndices(Iterator[int]):
    """An endless sequence of random permutations of integers.

    Args:
        integers: The integers, at least one.
        generator: Random generator of the permutations.

    Attributes:
        remaining: Integers of the current permutation that have not been returned yet.
    """

    def __init__(self, integers: Sequence[int], generator: torch.Generator) -> None:
        self._integers = integers
        self._generator = generator
        self.remaining: list[int] = []

    def __next__(self) -> int:
        """Return the next integer; start a new permutation when the current one is used up."""
        if not self.remaining:
            order = torch.randperm(len(self._integers), generator=self._generator).tolist()
            self.remaining = [self._integers[index] for index in order]
        return self.remaining.pop(0)


def average_squares(picture: Tensor, downscale: int) -> Tensor:
    """Downscale a picture `[H, W, C]` by averaging squares of `downscale` x `downscale` pixels."""
    if downscale == 1:
        return picture
    means = torch.nn.functional.avg_pool2d(picture.permute(2, 0, 1), downscale)
    return means.permute(1, 2, 0).contiguous()


def measure_extent(cameras: tuple[Camera, ...]) -> float:
    """Return the extent of a capture in world units, as defined by 3DGS.

    The extent is 1.1 times the largest distance of a camera from the mean of all camera
    centers. If all cameras are at the same position, the extent is 1.
    """
    rotations = torch.tensor([camera.rotation for camera in cameras], dtype=torch.float64)
    translations = torch.tensor([camera.translation for camera in cameras], dtype=torch.float64)
    centers = -(rotations.reshape(-1, 3, 3).mT @ translations[..., None])[..., 0]
    return 1.1 * float((centers - centers.mean(dim=0)).norm(dim=1).max()) or 1.0
