"""Checks the lenses of a capture: their principal points, and the shape of their pixels."""

from collections.abc import Sequence

from quarc_ref.datasets.calibration import CalibratedCamera, Lens
from quarc_ref.datasets.findings import Finding, format_names

_MIN_MARGIN = 0.1  # of width and height, between the principal point and the border
_MAX_SHAPE_ERROR = 0.02  # relative; calibrations of lenses are less accurate than video formats
_SQUARE = 1.0


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


def find_stretched_pixels(
    cameras: Sequence[CalibratedCamera], pixel_aspects: Sequence[float]
) -> Finding | None:
    """Return a finding if pixels are not square, but the lenses do not know it, or None.

    Args:
        cameras: Cameras before undistortion.
        pixel_aspects: `[camera]` width of a pixel divided by its height, which the video states.
    """
    stretched = [
        (camera, aspect)
        for camera, aspect in zip(cameras, pixel_aspects, strict=True)
        if aspect != _SQUARE
        and abs(camera.lens.fy / camera.lens.fx / aspect - 1) > _MAX_SHAPE_ERROR
    ]
    if not stretched:
        return None
    names, (camera, aspect) = tuple(camera.name for camera, _ in stretched), stretched[0]
    message = (
        f"the videos of {format_names(names)} state that pixels are {aspect:.3g} times as wide as "
        f"high, but the focal lengths of the lenses are {camera.lens.fx:g} and {camera.lens.fy:g} "
        "pixels, so the geometry is wrong: make the pixels square (ffmpeg -i OLD.mp4 -vf "
        "scale=iw*sar:ih,setsar=1 NEW.mp4), and calibrate again; if they are square already, "
        f"correct the ratio (ffmpeg -i OLD.mp4 -c copy -aspect {camera.lens.width}:"
        f"{camera.lens.height} NEW.mp4)"
    )
    return Finding("pixel-shape", message, names)


def _has_odd_principal_point(lens: Lens) -> bool:
    positions = (lens.cx / lens.width, lens.cy / lens.height)
    return not all(_MIN_MARGIN <= position <= 1 - _MIN_MARGIN for position in positions)
