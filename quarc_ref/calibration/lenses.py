"""Assumptions about lenses: their model, whether all are alike, or known values."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from quarc_ref.calibration.errors import CalibrationError
from quarc_ref.datasets.calibration import Lens
from quarc_ref.datasets.colmap_cameras import CAMERA_MODELS
from quarc_ref.datasets.layouts.table import choose_layout
from quarc_ref.datasets.pictures import Size

AUTO_MODEL = "auto"
FIRST_MODEL = "SIMPLE_RADIAL"  # what `auto` begins with
PLAIN_MODEL = "SIMPLE_PINHOLE"  # what it ends with if the pictures are as well explained so


@dataclass(frozen=True, slots=True)
class LensOptions:
    """Assumptions about the lenses of a rig.

    Attributes:
        model: A camera model of COLMAP, or `auto`: one coefficient of radial distortion
            if the pictures need it, else none.
        shared: Whether all cameras with pictures of the same size have the same lens.
        known: Lenses by the names of cameras, which are then not estimated; None to
            estimate all.

    Raises:
        ValueError: The model is not known.
    """

    model: str = AUTO_MODEL
    shared: bool = True
    known: Mapping[str, Lens] | None = None

    def __post_init__(self) -> None:
        if self.model not in (AUTO_MODEL, *CAMERA_MODELS):
            message = f"camera model {self.model} is not {AUTO_MODEL}, {', '.join(CAMERA_MODELS)}"
            raise ValueError(message)


def read_lenses(capture: Path, names: Sequence[str], sizes: Sequence[Size]) -> dict[str, Lens]:
    """Return the lenses of another capture of the same cameras.

    Args:
        capture: Folder of a capture in any layout; its poses are not used.
        names: Names of the cameras.
        sizes: `[camera]` width and height of their pictures.

    Raises:
        CalibrationError: The capture lacks a camera, or has pictures of another size.
        CaptureError: It cannot be read.
    """
    found = {camera.name: camera.lens for camera in choose_layout(capture).read(capture).cameras}
    missing = [name for name in names if name not in found]
    if missing:
        message = (
            f"{capture} has no lens for camera {', '.join(missing)}, but of {', '.join(found)}"
        )
        raise CalibrationError(message)
    for name, size in zip(names, sizes, strict=True):
        lens = found[name]
        if size != (lens.width, lens.height):
            message = (
                f"the lens of camera {name} in {capture} is for pictures of "
                f"{lens.width}x{lens.height}, but its recording is {size[0]}x{size[1]}"
            )
            raise CalibrationError(message)
    return {name: found[name] for name in names}
