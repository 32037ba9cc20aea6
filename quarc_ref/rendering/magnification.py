"""The low-pass filter of pictures that differ from the capture's in size or distance (SPEC 10.3).

Training fits Gaussians together with the low-pass filter of the capture's pictures. Many of them
are thinner than this filter. If a picture is magnified and the filter is not, they become thin
lines with gaps between them; if a picture is made smaller, the filter makes them too large.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.camera_geometry import camera_center
from quarc_ref.format.cameras import Camera
from quarc_ref.format.constants import LOW_PASS
from quarc_ref.rendering.pipeline_data import Float32, Projection
from quarc_ref.rendering.projection_kernels import MIN_ALPHA

_MAX_APPROACH = 4.0  # the filter follows the distance up to this factor
_WEIGHT_EXPONENT = -8  # of the distance to a capture camera

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Magnification:
    """The size of a picture relative to pictures of the capture.

    Attributes:
        x: Focal length in x, divided by the nearest one of the capture's range; 1 within the range.
        y: The same for y.
        center: Mean center of the capture's cameras, of which the nearest weigh most, world units;
            None if the picture is seen from the center of one of them.
    """

    x: float = 1.0
    y: float = 1.0
    center: Point | None = None

    @property
    def max_low_pass(self) -> tuple[float, float]:
        """Maximum variances of the low-pass filter in x and y, in pixels."""
        approach = 1.0 if self.center is None else _MAX_APPROACH
        x, y = (max(1.0, approach * factor) for factor in (self.x, self.y))
        return LOW_PASS * x * x, LOW_PASS * y * y  # infinite, not an error, if too large

    def filter(self, projection: Projection, positions: Float32, camera: Camera) -> Projection:
        """Replace the low-pass filter of projected Gaussians by the one for their distances.

        Opacities are reduced where the filter is wider than the one that training used.

        Args:
            projection: Projected Gaussians, whose covariances include `max_low_pass`.
            positions: `[N, 3]` positions of the Gaussians, world units.
            camera: The camera for which they were projected.
        """
        if self == UNMAGNIFIED:
            return projection
        inverse_a, inverse_b, inverse_c = projection.conics.astype(np.float64).T
        with np.errstate(all="ignore"):  # invisible Gaussians have no covariance
            det = 1 / (inverse_a * inverse_c - inverse_b**2)
            a = inverse_c * det - self.max_low_pass[0]
            b = -inverse_b * det
            c = inverse_a * det - self.max_low_pass[1]
            approach = self._measure_approach(positions, camera)
            trained_x, trained_y = (LOW_PASS * np.square(k * approach) for k in (self.x, self.y))
            trained_det = (a + trained_x) * (c + trained_y) - b**2
            a += np.maximum(LOW_PASS, trained_x)
            c += np.maximum(LOW_PASS, trained_y)
            det = a * c - b**2
            opacities = projection.opacities * np.sqrt(np.clip(trained_det / det, 0, 1))
            max_exponents = np.log(opacities / MIN_ALPHA)
            conics = np.column_stack([c, -b, a]) / det[:, None]
        is_visible = (projection.max_exponents > 0) & (max_exponents > 0)
        return replace(
            projection,
            conics=np.where(is_visible[:, None], conics, 0).astype(np.float32),
            opacities=np.where(is_visible, opacities, 0).astype(np.float32),
            max_exponents=np.where(is_visible, max_exponents, 0).astype(np.float32),
        )

    def _measure_approach(self, positions: Float32, camera: Camera) -> NDArray[np.float64] | float:
        """Return the `[N]` factors by which Gaussians are nearer than they were to the capture."""
        if self.center is None:
            return 1.0
        capture_distances, distances = (
            np.linalg.norm(positions - np.array(center), axis=1)
            for center in (self.center, camera_center(camera))
        )
        factors: NDArray[np.float64] = capture_distances / distances
        return factors.clip(1 / _MAX_APPROACH, _MAX_APPROACH)


UNMAGNIFIED = Magnification()


def measure_magnification(camera: Camera, capture_cameras: Sequence[Camera]) -> Magnification:
    """Return the magnification of a camera's picture.

    Args:
        camera: Camera of the picture.
        capture_cameras: Cameras of the capture; if there are none, nothing is magnified.
    """
    if not capture_cameras:
        return UNMAGNIFIED
    return Magnification(
        _divide_by_range(camera.fx, [other.fx for other in capture_cameras]),
        _divide_by_range(camera.fy, [other.fy for other in capture_cameras]),
        _find_capture_center(camera, capture_cameras),
    )


def _divide_by_range(focal_length: float, capture_focal_lengths: Sequence[float]) -> float:
    """Divide a focal length by the nearest one between the smallest and the largest."""
    nearest = max(min(focal_length, max(capture_focal_lengths)), min(capture_focal_lengths))
    return focal_length / nearest


def _find_capture_center(camera: Camera, capture_cameras: Sequence[Camera]) -> Point | None:
    """Return the mean center of the capture's cameras, of which the nearest weigh most.

    The result is None if a camera of the capture has the same center.
    """
    centers = np.array([camera_center(other) for other in capture_cameras])
    distances = np.linalg.norm(centers - np.array(camera_center(camera)), axis=1)
    if not distances.min() > 0:
        return None
    weights = (distances / distances.min()) ** _WEIGHT_EXPONENT
    x, y, z = (weights @ centers / weights.sum()).tolist()
    return x, y, z
