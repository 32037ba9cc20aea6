"""The initial points of a capture, projected into all training views, for checks of the capture."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.camera_geometry import PointProjection
from quarc_ref.datasets.capture import Capture, Image
from quarc_ref.format.cameras import Camera


@dataclass(frozen=True, slots=True, eq=False)
class ProjectedPoints:
    """A random sample of the initial points, projected into all training views.

    Attributes:
        cameras: The training cameras whose picture of frame 0 is used.
        positions: `[P, 3]` positions, world units.
        colors: `[P, 3]` sRGB colors, 0 to 255.
        projections: Projection of the points into each camera.
        is_visible: `[V, P]` whether a point projects into the picture of a camera.
        is_blank: `[V]` whether the picture of a camera shows nothing; False if the background is
            transparent.
    """

    cameras: tuple[Camera, ...]
    positions: NDArray[np.float32]
    colors: NDArray[np.uint8]
    projections: tuple[PointProjection, ...]
    is_visible: NDArray[np.bool_]
    is_blank: NDArray[np.bool_]

    def name_cameras(self, indices: Sequence[int] | NDArray[np.intp]) -> tuple[str, ...]:
        """Return the names of cameras, given by their indices in `cameras`."""
        return tuple(self.cameras[index].name for index in indices)


def read_first_frame(capture: Capture) -> Iterator[Image]:
    """Yield the used training pictures of frame 0 of the full capture.

    Frame 0 is used because the initial points represent the scene at that frame.
    """
    full_capture = capture.full_capture
    return (full_capture.image(index, 0) for index in full_capture.training_at(0))
