"""A ring of cameras that look at the center of the ring."""

import math
from dataclasses import replace

import numpy as np

from quarc_ref.format.cameras import Camera
from quarc_ref.viewing.paths.pose import look_at


def make_ring(center, count=8, radius=4.0):
    """Return cameras cam0, cam1, ... around a center, alternately above and below it."""
    reference_camera = Camera(
        "", 48, 32, 40.0, 40.0, 24.0, 16.0, (1, 0, 0, 0, 1, 0, 0, 0, 1), (0, 0, 0), 0.5, False
    )
    cameras = []
    for index in range(count):
        angle = 2 * math.pi * index / count
        offset = np.array([radius * math.cos(angle), radius * math.sin(angle), 0.5 - index % 2])
        pose = look_at(center + offset, center, np.array([0.0, 0.0, 1.0]), 2 * math.atan(0.4))
        camera = pose.as_camera(reference_camera)
        cameras.append(Camera(f"cam{index}", *(getattr(camera, name) for name in _OTHER_FIELDS)))
    return cameras


def mirror_cameras(cameras):
    """Return cameras that see a mirrored, left-handed world, and the mirror matrix `[3, 3]`."""
    mirror = np.diag([-1.0, 1.0, 1.0])
    mirrored_cameras = [
        replace(
            camera, rotation=tuple((np.reshape(camera.rotation, (3, 3)) @ mirror).ravel().tolist())
        )
        for camera in cameras
    ]
    return mirrored_cameras, mirror


_OTHER_FIELDS = [name for name in Camera.__dataclass_fields__ if name != "name"]
