"""Plots the cameras of a rig and the scene points."""

import io
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from quarc_ref.datasets.calibration import CalibratedCamera, Float64Array
from quarc_ref.datasets.capture import Points

_TEXT_COLOR, _TICK_COLOR, _CAMERA_COLOR = "#4a545e", "#9aa3ad", "#3b6ea8"
_DOTS_PER_INCH = 110
_MAX_POINTS = 4000
_LABEL_ROWS = 3
_LABEL_HEIGHT = 8  # points
_SIGHT_LINE_LENGTH = 0.22  # length of a line of sight, relative to the radius of the shown region
_REGION_RADIUS_FACTOR = 1.25  # radius of the shown region, relative to the radius of the rig


def plot_rig(cameras: Sequence[CalibratedCamera], points: Points, unit: str) -> bytes:
    """Plot a rig from above and from the front, and return the plot as a PNG file.

    Args:
        cameras: Cameras in a world whose up direction is -y.
        points: Scene points in the same world as the cameras.
        unit: Unit of length, for the labels of the axes.
    """
    figure = Figure(figsize=(10, 5.2), layout="constrained")
    centers = np.array([-camera.pose.rotation.T @ camera.pose.translation for camera in cameras])
    directions = np.array([camera.pose.rotation[2] for camera in cameras])
    point_step = -(-len(points.positions) // _MAX_POINTS)
    shown_points = (
        points.positions[::point_step].astype(np.float64),
        points.colors[::point_step] / 255,
    )
    names = [camera.name for camera in cameras]
    views = (("from above", (0, 2), "depth"), ("from the front", (0, 1), "height"))
    for column, (title, axis_indices, label) in enumerate(views, start=1):
        axes = figure.add_subplot(1, 2, column)
        _draw_rig(axes, (centers, directions), shown_points, axis_indices, names)
        axes.set_title(title, color=_TEXT_COLOR, fontsize=10)
        axes.set_xlabel(f"{unit}, across")
        axes.set_ylabel(f"{unit}, {label}")
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=_DOTS_PER_INCH)
    return buffer.getvalue()


def _draw_rig(
    axes: Axes,
    centers_and_directions: tuple[Float64Array, Float64Array],
    positions_and_colors: tuple[Float64Array, Float64Array],
    axis_indices: tuple[int, int],
    names: Sequence[str],
) -> None:
    """Draw cameras, their lines of sight and scene points, projected onto two world axes."""
    signs = np.array([1.0, -1.0 if axis_indices[1] == 1 else 1.0])  # -y is up
    centers, directions = (values[:, axis_indices] * signs for values in centers_and_directions)
    all_positions, colors = positions_and_colors
    positions = all_positions[:, axis_indices] * signs
    radius = _REGION_RADIUS_FACTOR * max(float(np.abs(centers).max()), 1e-9)
    is_inside = (np.abs(positions) < radius).all(axis=1)
    horizontal, vertical = positions[is_inside].T
    axes.scatter(horizontal, vertical, s=2, c=colors[is_inside], linewidths=0)
    label_rows = np.argsort(np.argsort(centers[:, 0])) % _LABEL_ROWS
    for name, center, direction, row in zip(names, centers, directions, label_rows, strict=True):
        sight_line = np.stack([center, center + _SIGHT_LINE_LENGTH * radius * direction])
        axes.plot(*sight_line.T, color=_CAMERA_COLOR, lw=1)
        axes.plot(*center, "o", color=_CAMERA_COLOR, markersize=4)
        axes.annotate(
            name,
            center,
            (3, -9 - _LABEL_HEIGHT * int(row)),  # below the camera; neighbors get different rows
            textcoords="offset points",
            color=_TEXT_COLOR,
            fontsize=7,
            annotation_clip=True,
        )
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(color="#e3e7ec", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(colors=_TICK_COLOR, labelsize=8)
