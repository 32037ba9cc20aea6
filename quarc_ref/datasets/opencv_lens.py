"""Makes a lens from the camera matrix and the coefficients of OpenCV's camera model."""

from collections.abc import Sequence

from quarc_ref.datasets.calibration import Float64Array, Lens
from quarc_ref.datasets.pictures import Size

_CENTER_SHIFT = 0.5  # Added to principal points, because `Lens` has pixel centers at +0.5.
_MAX_SKEW = 0.5  # Pixels; largest shift of a picture's top or bottom row.


def make_opencv_lens(size: Size, matrix: Float64Array, coefficients: Sequence[float]) -> Lens:
    """Return the lens of a camera that OpenCV calibrated.

    Args:
        size: Width and height of the pictures, pixels.
        matrix: `[3, 3]` camera matrix K; pixel centers are at whole numbers.
        coefficients: At most eight distortion coefficients, in OpenCV's order.

    Raises:
        ValueError: The matrix has skew, or a number is out of range.
    """
    width, height = size
    (fx, skew, cx), (_, fy, cy), _ = matrix.tolist()
    lens = Lens(
        width=width,
        height=height,
        fx=fx,
        fy=fy,
        cx=cx + _CENTER_SHIFT,
        cy=cy + _CENTER_SHIFT,
        coefficients=tuple(coefficients) if any(coefficients) else (),
    )
    shift = abs(skew) / fy * max(lens.cy, height - lens.cy)
    if not shift <= _MAX_SKEW:
        message = (
            f"the skew {skew:g} in K moves pixels by up to {shift:.1f}, which is not supported: "
            "calibrate without skew"
        )
        raise ValueError(message)
    return lens
