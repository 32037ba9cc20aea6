"""Rigs with known poses for tests of calibration."""

import numpy as np

from quarc_ref.datasets.calibration import CalibratedCamera, Lens, make_pose

LENS = Lens(64, 48, 60.0, 60.0, 32.0, 24.0)


def look_at(name, center, target=(0.0, 0.0, 0.0), up=(0.0, -1.0, 0.0), roll=0.0):
    """Return a camera that looks at a target; the roll about the optical axis is in radians."""
    center = np.asarray(center, float)
    forward = np.asarray(target, float) - center
    forward /= np.linalg.norm(forward)
    right = np.cross(-np.asarray(up, float), forward)
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    axes = np.stack([right, down, forward], axis=1)
    cosine, sine = np.cos(roll), np.sin(roll)
    rotated = axes @ np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    return CalibratedCamera(name, LENS, make_pose(rotated, center))


def make_ring(count=6, radius=3.0, height=0.5):
    """Return level cameras on a circle above the origin; up is -y."""
    angles = 2 * np.pi * np.arange(count) / count
    return [
        look_at(f"cam{i:02}", (radius * np.sin(a), -height, radius * np.cos(a)))
        for i, a in enumerate(angles)
    ]


def center(camera):
    return -camera.pose.rotation.T @ camera.pose.translation


def transform_camera(camera, rotation, shift, scale):
    """Return a camera in a rotated, scaled and shifted world."""
    axes = rotation @ camera.pose.rotation.T
    return CalibratedCamera(
        camera.name, camera.lens, make_pose(axes, scale * (rotation @ center(camera)) + shift)
    )


def measure_pose_errors(estimated, expected):
    """Return maximum errors of rotation (degrees) and position (relative to the rig's size)."""
    correlation = sum(
        expected_camera.pose.rotation.T @ estimated_camera.pose.rotation
        for estimated_camera, expected_camera in zip(estimated, expected, strict=True)
    )
    left_vectors, _, right_vectors = np.linalg.svd(correlation)
    rotation = (
        left_vectors @ np.diag([1, 1, np.linalg.det(left_vectors @ right_vectors)]) @ right_vectors
    )
    centers = np.array([rotation @ center(camera) for camera in estimated])
    expected_centers = np.array([center(camera) for camera in expected])
    centers, expected_centers = (
        centers - centers.mean(axis=0),
        expected_centers - expected_centers.mean(axis=0),
    )
    scale = (centers * expected_centers).sum() / (centers**2).sum()
    size = max(np.linalg.norm(a - b) for a in expected_centers for b in expected_centers)
    angles = [
        np.degrees(
            np.arccos(
                np.clip(
                    (
                        np.trace(
                            expected_camera.pose.rotation
                            @ rotation
                            @ estimated_camera.pose.rotation.T
                        )
                        - 1
                    )
                    / 2,
                    -1,
                    1,
                )
            )
        )
        for estimated_camera, expected_camera in zip(estimated, expected, strict=True)
    ]
    return max(angles), np.linalg.norm(scale * centers - expected_centers, axis=1).max() / size
