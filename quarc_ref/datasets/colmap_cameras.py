"""Converts lenses from and to COLMAP cameras, and turns off COLMAP's log.

COLMAP's camera models are documented at colmap.github.io/cameras.html. In each supported model,
the parameters after the principal point are the first few of OpenCV's distortion coefficients, in
OpenCV's order.
"""

from collections.abc import Iterator
from contextlib import contextmanager

from quarc_ref.datasets.calibration import Lens
from quarc_ref.datasets.colmap_import import pycolmap
from quarc_ref.datasets.errors import UnsupportedCameraError

CAMERA_MODELS = (
    "SIMPLE_PINHOLE",
    "PINHOLE",
    "SIMPLE_RADIAL",
    "RADIAL",
    "OPENCV",
    "FULL_OPENCV",
    "SIMPLE_RADIAL_FISHEYE",
    "RADIAL_FISHEYE",
    "OPENCV_FISHEYE",
)
_OPENCV_COEFFICIENT_COUNT = 4
_FULL_OPENCV_COEFFICIENT_COUNT = 8


def make_lens(name: str, camera: "pycolmap.Camera") -> Lens:
    """Return the lens of a COLMAP camera.

    Args:
        name: Name of the camera in error messages.
        camera: The COLMAP camera.

    Raises:
        UnsupportedCameraError: The camera model is not supported.
        ValueError: A camera parameter is out of range.
    """
    if camera.model.name not in CAMERA_MODELS:
        message = (
            f"camera {name} has the unsupported camera model {camera.model.name}: undistort its "
            "pictures with COLMAP first, or use one of the models "
            f"{', '.join(sorted(CAMERA_MODELS))}"
        )
        raise UnsupportedCameraError(message)
    return Lens(
        width=camera.width,
        height=camera.height,
        fx=camera.focal_length_x,
        fy=camera.focal_length_y,
        cx=camera.principal_point_x,
        cy=camera.principal_point_y,
        coefficients=tuple(float(camera.params[i]) for i in camera.extra_params_idxs()),
        fisheye=camera.model.name.endswith("FISHEYE"),
    )


def make_colmap_camera(lens: Lens, camera_id: int) -> "pycolmap.Camera":
    """Return the COLMAP camera for a lens.

    Args:
        lens: Lens of the camera, with or without distortion.
        camera_id: Id of the camera in the COLMAP model.
    """
    coefficients = list(lens.coefficients)
    if lens.fisheye:
        model, coefficient_count = pycolmap.CameraModelId.OPENCV_FISHEYE, _OPENCV_COEFFICIENT_COUNT
    elif lens.is_pinhole:
        model, coefficient_count = pycolmap.CameraModelId.PINHOLE, 0
    elif not any(coefficients[_OPENCV_COEFFICIENT_COUNT:]):
        model, coefficient_count = pycolmap.CameraModelId.OPENCV, _OPENCV_COEFFICIENT_COUNT
    else:
        model, coefficient_count = (
            pycolmap.CameraModelId.FULL_OPENCV,
            _FULL_OPENCV_COEFFICIENT_COUNT,
        )
    padded_coefficients = (coefficients + [0.0] * coefficient_count)[:coefficient_count]
    return pycolmap.Camera(
        camera_id=camera_id,
        model=model,
        width=lens.width,
        height=lens.height,
        params=[lens.fx, lens.fy, lens.cx, lens.cy, *padded_coefficients],
    )


@contextmanager
def silence_colmap() -> Iterator[None]:
    """Turn off pycolmap's log messages within the block."""
    previous_level = pycolmap.logging.minloglevel
    pycolmap.logging.minloglevel = pycolmap.logging.FATAL.value
    try:
        yield
    finally:
        pycolmap.logging.minloglevel = previous_level
