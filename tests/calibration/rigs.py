"""Rigs with known poses for tests of calibration."""

import numpy as np

from quarc_ref.datasets.calibration import CalibratedCamera, Lens, make_pose

LENS = Lens(64, 48, 60.0, 60.0, 32.0, 24.0)


def look_at(name, center, target=(0.0, 0.0, 0.0), up=(0.0, -1.0, 0.0), roll=0.0):
    """A camera that looks at a target, with a roll around its optical axis in radians."""
    center = np.asarray(center, float)
    forward = np.asarray(target, float) - center
    forward /= np.linalg.norm(forward)
    right = np.cross(-np.asarray(up, float), forward)
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    axes = np.stack([right, down, forward], axis=1)
    c, s = np.cos(roll), np.sin(roll)
    turned = axes @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    return CalibratedCamera(name, LENS, make_pose(turned, center))


def ring(count=6, radius=3.0, height=0.5):
    """Level cameras around the origin, above it; up is -y."""
    angles = 2 * np.pi * np.arange(count) / count
    return [
        look_at(f"cam{i:02}", (radius * np.sin(a), -height, radius * np.cos(a)))
        for i, a in enumerate(angles)
    ]


def center(camera):
    return -camera.pose.rotation.T @ camera.pose.translation


def move(camera, turn, shift, scale):
    """The same camera in a rotated, scaled and shifted world."""
    axes = turn @ camera.pose.rotation.T
    return CalibratedCamera(
        camera.name, camera.lens, make_pose(axes, scale * (turn @ center(camera)) + shift)
    )


def compare(found, true):
    """Maximum errors of rotation (degrees) and position (sizes of the rig) after alignment."""
    total = sum(t.pose.rotation.T @ f.pose.rotation for f, t in zip(found, true, strict=True))
    left, _, right = np.linalg.svd(total)
    turn = left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right
    places = np.array([turn @ center(camera) for camera in found])
    wanted = np.array([center(camera) for camera in true])
    places, wanted = places - places.mean(axis=0), wanted - wanted.mean(axis=0)
    scale = (places * wanted).sum() / (places**2).sum()
    size = max(np.linalg.norm(a - b) for a in wanted for b in wanted)
    angles = [
        np.degrees(
            np.arccos(
                np.clip((np.trace(t.pose.rotation @ turn @ f.pose.rotation.T) - 1) / 2, -1, 1)
            )
        )
        for f, t in zip(found, true, strict=True)
    ]
    return max(angles), np.linalg.norm(scale * places - wanted, axis=1).max() / size
