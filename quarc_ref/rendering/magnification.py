"""The low-pass filter of pictures that are larger or smaller than the capture's (SPEC 10.3).

Training fits Gaussians together with the low-pass filter of the capture's pictures. Many of them
are thinner than this filter. If a picture is magnified and the filter is not, they become thin
lines with gaps between them; if a picture is made smaller, the filter makes them too large.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.pipeline import LOW_PASS
from quarc_ref.rendering.pipeline_data import Projection
from quarc_ref.rendering.projection_kernels import MIN_ALPHA


@dataclass(frozen=True, slots=True)
class Magnification:
    """The size of a picture's pixels relative to that of a capture's pixels, in x and y.

    Attributes:
        x: Focal length in x, divided by the nearest one of the capture's range; 1 within the range.
        y: The same for y.
    """

    x: float = 1.0
    y: float = 1.0

    @property
    def low_pass(self) -> tuple[float, float]:
        """Variances of the low-pass filter in x and y, in pixels."""
        return LOW_PASS * max(1.0, self.x) ** 2, LOW_PASS * max(1.0, self.y) ** 2

    def preserve_energy(self, projection: Projection) -> Projection:
        """Reduce opacities where the filter is wider than the one that training used.

        Args:
            projection: Projected Gaussians; their covariances include the low-pass filter.
        """
        if self.x >= 1 and self.y >= 1:
            return projection
        inverse_a, inverse_b, inverse_c = projection.conics.astype(np.float64).T
        with np.errstate(all="ignore"):  # invisible Gaussians have no covariance
            det = 1 / (inverse_a * inverse_c - inverse_b**2)
            a, b, c = inverse_c * det, -inverse_b * det, inverse_a * det
            trained_a = a - self.low_pass[0] + LOW_PASS * self.x**2
            trained_c = c - self.low_pass[1] + LOW_PASS * self.y**2
            factors = np.sqrt(np.clip((trained_a * trained_c - b**2) / det, 0, 1))
            opacities = (projection.opacities * factors).astype(np.float32)
            max_exponents = np.log(opacities / MIN_ALPHA)
        is_visible = (projection.max_exponents > 0) & (max_exponents > 0)
        return replace(
            projection,
            opacities=opacities,
            max_exponents=np.where(is_visible, max_exponents, 0).astype(np.float32),
        )


UNMAGNIFIED = Magnification()


def measure_magnification(camera: Camera, capture_cameras: Sequence[Camera]) -> Magnification:
    """Return the magnification of a camera's picture.

    Args:
        camera: Camera of the picture.
        capture_cameras: Cameras of the capture; if there are none, the magnification is 1.
    """
    if not capture_cameras:
        return UNMAGNIFIED
    return Magnification(
        _divide_by_range(camera.fx, [other.fx for other in capture_cameras]),
        _divide_by_range(camera.fy, [other.fy for other in capture_cameras]),
    )


def _divide_by_range(focal_length: float, capture_focal_lengths: Sequence[float]) -> float:
    """Divide a focal length by the nearest one between the smallest and the largest."""
    nearest = max(min(focal_length, max(capture_focal_lengths)), min(capture_focal_lengths))
    return focal_length / nearest
