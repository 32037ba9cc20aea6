"""A ring of cameras around a center, which they look at."""

import math

import numpy as np

from quarc_ref.format.cameras import Camera
from quarc_ref.viewing.paths.pose import look_at


def make_ring(center, count=8, radius=4.0):
    """Level cameras cam0, cam1, ... around a center, some above it and some below."""
    like = Camera(
        "", 48, 32, 40.0, 40.0, 24.0, 16.0, (1, 0, 0, 0, 1, 0, 0, 0, 1), (0, 0, 0), 0.5, False
    )
    cameras = []
    for place in range(count):
        angle = 2 * math.pi * place / count
        offset = np.array([radius * math.cos(angle), radius * math.sin(angle), 0.5 - place % 2])
        pose = look_at(center + offset, center, np.array([0.0, 0.0, 1.0]), 2 * math.atan(0.4))
        camera = pose.as_camera(like)
        cameras.append(Camera(f"cam{place}", *(getattr(camera, name) for name in _REST)))
    return cameras


_REST = [name for name in Camera.__dataclass_fields__ if name != "name"]
