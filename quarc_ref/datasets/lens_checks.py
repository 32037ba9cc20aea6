"""Checks the lenses of a capture: their principal points."""

from collections.abc import Sequence

from quarc_ref.datasets.calibration import CalibratedCamera, Lens
from quarc_ref.datasets.findings import Finding, format_names

_MIN_MARGIN = 0.1  # of width and height, between the principal point and the border


def find_odd_principal_points(cameras: Sequence[CalibratedCamera]) -> Finding | None:
    """Return a finding about principal points that are far from the center, or None.

    Args:
        cameras: Cameras before undistortion.
    """
    odd_cameras = [camera for camera in cameras if _has_odd_principal_point(camera.lens)]
    if not odd_cameras:
        return None
    names, lens = tuple(camera.name for camera in odd_cameras), odd_cameras[0].lens
    message = (
        f"the principal point of {format_names(names)} is far from the center of the pictures: "
        f"{lens.cx:g}, {lens.cy:g} in {lens.width}x{lens.height} pixels; if the pictures are not "
        "cropped, correct it (in pixels, from the top left corner)"
    )
    return Finding("principal-point", message, names)


def _has_odd_principal_point(lens: Lens) -> bool:
    positions = (lens.cx / lens.width, lens.cy / lens.height)
    return not all(_MIN_MARGIN <= position <= 1 - _MIN_MARGIN for position in positions)
