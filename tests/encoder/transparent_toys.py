"""A toy capture of a subject in front of a transparent background: only the small Gaussians."""

import numpy as np
import torch

from quarc_ref.datasets.capture import Capture, Points
from quarc_ref.decoder.dequantize import Splats
from quarc_ref.encoder.training.trainable import from_splats
from quarc_ref.rendering.raster_numba import NumbaRasterizer
from tests.encoder.toys import make_cameras, make_splats

_WALL_COUNT = 63


def make_subject(frame):
    """Return the small Gaussians of `make_splats`, in dark colors."""
    splats = make_splats(frame)
    arrays = (splats.positions, splats.rotations, splats.log_scales, splats.opacities, splats.sh)
    positions, rotations, log_scales, opacities, sh = (array[_WALL_COUNT:] for array in arrays)
    return Splats(positions, rotations, log_scales, opacities, sh * 0.5 - 0.8)


def render_on(splats, camera, background):
    """Render the `[H, W, 3]` picture and `[H, W]` alpha of Gaussians on a background color."""
    gaussians = from_splats(splats, torch.device("cpu")).activated()
    with torch.no_grad():
        rendering = NumbaRasterizer().render(
            gaussians, camera, torch.tensor(background, dtype=torch.float32)
        )
    return rendering.image.numpy().clip(0, 1), rendering.alpha.numpy()


class _RenderedSource:
    """Pictures on black, or their alpha."""

    def __init__(self, cameras, part, seen_by):
        self._cameras, self._part, self._seen_by = cameras, part, seen_by

    def read(self, camera, frame):
        parts = render_on(make_subject(frame), self._cameras[camera], (0.0, 0.0, 0.0))
        picture = np.round(parts[self._part] * 255).astype(np.uint8)
        return picture if camera in self._seen_by else np.zeros_like(picture)


def make_subject_capture(frame_count=4, *, has_alpha=True, seen_by=range(4)):
    """Return a capture of the subject; without alpha, its background is an opaque black.

    The subject has left the pictures of the cameras that are not in `seen_by`.
    """
    cameras = make_cameras()
    splats = make_subject(0)
    points = Points(splats.positions, np.full(splats.positions.shape, 60, np.uint8))
    pictures, alphas = (_RenderedSource(cameras, part, seen_by) for part in (0, 1))
    return Capture(
        "subject", cameras, frame_count, 30.0, points, pictures, "0" * 64,
        alphas=alphas if has_alpha else None,
    )  # fmt: skip
