"""Captures with planted faults: wrong points, cameras or pictures."""

from dataclasses import replace

import numpy as np

from quarc_ref.datasets.capture import Capture, Points


def plant(capture, *, cameras=None, points=None, order=None):
    """Return a capture after replacing its cameras or points, or the order of its pictures."""
    order = order or range(len(capture.cameras))
    return Capture(
        capture.name,
        cameras or capture.cameras,
        capture.frame_count,
        capture.frames_per_second,
        points or capture.points,
        _Reordered(capture.image, order),
        capture.fingerprint,
        alphas=_Reordered(capture.alpha, order) if capture.alphas else None,
    )


class _Reordered:
    def __init__(self, read, order):
        self._read = read
        self._order = order

    def read(self, camera, frame):
        return self._read(self._order[camera], frame).copy()


def fade_subject(capture, cameras, largest_alpha):
    """Return the capture after reducing the alpha of some cameras, and so darkening the pictures.

    Args:
        capture: A capture with alpha.
        cameras: Indices of the cameras.
        largest_alpha: Alpha of what was opaque, 0 to 255.
    """
    faded = plant(capture)
    for name in ("_source", "alphas"):
        setattr(faded, name, _Faded(getattr(faded, name), cameras, largest_alpha))
    return faded


class _Faded:
    def __init__(self, source, cameras, largest_alpha):
        self._source, self._cameras, self._largest_alpha = source, cameras, largest_alpha

    def read(self, camera, frame):
        levels = self._source.read(camera, frame)
        if camera not in self._cameras:
            return levels
        return (levels.astype(np.uint16) * self._largest_alpha // 255).astype(np.uint8)


def keep_cameras(capture, camera_indices):
    """Return the capture with only the cameras at some indices."""
    return plant(
        capture,
        cameras=[capture.cameras[index] for index in camera_indices],
        order=list(camera_indices),
    )


def swap_pictures(capture, first, second):
    """Return the capture after swapping the pictures of two cameras."""
    order = list(range(len(capture.cameras)))
    order[first], order[second] = second, first
    return plant(capture, order=order)


def turn_camera(capture, index, axis, degrees):
    """Return the capture after rotating a camera around an axis of the camera."""
    angle = np.radians(degrees)
    rotation = np.eye(3)
    rotation[np.ix_(*[[other_axis for other_axis in range(3) if other_axis != axis]] * 2)] = [
        [np.cos(angle), -np.sin(angle)],
        [np.sin(angle), np.cos(angle)],
    ]
    camera = capture.cameras[index]
    return _pose_camera(
        capture,
        index,
        rotation @ np.array(camera.rotation).reshape(3, 3),
        rotation @ np.array(camera.translation),
    )


def move_camera(capture, index, step):
    """Return the capture after moving a camera along the camera's axes, in world units."""
    camera = capture.cameras[index]
    rotation = np.array(camera.rotation).reshape(3, 3)
    return _pose_camera(capture, index, rotation, np.array(camera.translation) - step)


def _pose_camera(capture, index, rotation, translation):
    cameras = list(capture.cameras)
    cameras[index] = replace(
        cameras[index],
        rotation=tuple(rotation.ravel().tolist()),
        translation=tuple(translation.tolist()),
    )
    return plant(capture, cameras=cameras)


def move_points(capture, fraction, offset):
    """Return the capture after moving a fraction of its points by an offset in world units."""
    positions, colors = capture.points.positions.copy(), capture.points.colors
    indices = np.random.default_rng(1).permutation(len(positions))[: int(fraction * len(positions))]
    positions[indices] += np.array(offset, dtype=np.float32)
    return plant(capture, points=Points(positions, colors))


def paint_points(capture, colors):
    """Return the capture after replacing the colors of its points."""
    return plant(capture, points=Points(capture.points.positions, colors))
