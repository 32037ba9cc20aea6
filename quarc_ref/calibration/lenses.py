"""Assumptions about lenses: the camera model, shared lenses, and known lenses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from quarc_ref.calibration.errors import CalibrationError
from quarc_ref.datasets.calibration import Lens
from quarc_ref.datasets.colmap_cameras import CAMERA_MODELS
from quarc_ref.datasets.layouts.table import choose_layout
from quarc_ref.datasets.pictures import Size

AUTO_MODEL = "auto"
INITIAL_AUTO_MODEL = "SIMPLE_RADIAL"  # first model of `auto`
PINHOLE_MODEL = "SIMPLE_PINHOLE"  # final model of `auto` if it fits the pictures equally well


@dataclass(frozen=True, slots=True)
class LensOptions:
    """Assumptions about the lenses of a rig.

    Attributes:
        model: A COLMAP camera model, or `auto`. With `auto`, lenses have one coefficient of radial
            distortion, or none if pinholes fit the pictures equally well.
        is_shared: Whether cameras with the same picture size share a lens.
        known_lenses: Fixed lenses by camera name; None to estimate all lenses.

    Raises:
        ValueError: The model is unknown.
    """

    model: str = AUTO_MODEL
    is_shared: bool = True
    known_lenses: Mapping[str, Lens] | None = None

    def __post_init__(self) -> None:
        if self.model not in (AUTO_MODEL, *CAMERA_MODELS):
            message = (
                f"unknown camera model {self.model}; choose one of {AUTO_MODEL}, "
                f"{', '.join(CAMERA_MODELS)}"
            )
            raise ValueError(message)


def read_lenses(capture: Path, names: Sequence[str], sizes: Sequence[Size]) -> dict[str, Lens]:
    """Read the lenses of another capture of the same cameras.

    Args:
        capture: Folder of a capture in any layout; its poses are not used.
        names: Names of the cameras.
        sizes: Width and height of the pictures of each camera.

    Raises:
        CalibrationError: The capture lacks a camera, or has pictures of a different size.
        CaptureError: The capture cannot be read.
    """
    lenses = {camera.name: camera.lens for camera in choose_layout(capture).read(capture).cameras}
    missing_cameras = [name for name in names if name not in lenses]
    if missing_cameras:
        message = (
            f"{capture} has no intrinsics for camera {', '.join(missing_cameras)}; it has those of "
            f"{', '.join(lenses)}"
        )
        raise CalibrationError(message)
    for name, size in zip(names, sizes, strict=True):
        lens = lenses[name]
        if size != (lens.width, lens.height):
            message = (
                f"the intrinsics of camera {name} in {capture} are for pictures of "
                f"{lens.width}x{lens.height}, but the camera's recording is {size[0]}x{size[1]}"
            )
            raise CalibrationError(message)
    return {name: lenses[name] for name in names}
