"""Compares a decoded frame with the Gaussians from which it was encoded."""

from dataclasses import dataclass, fields

import numpy as np

from quarc_ref.decoder.scene import Scene
from quarc_ref.encoder.rotations import angles_between
from quarc_ref.encoder.scenes.bounds import Bounds
from quarc_ref.encoder.scenes.targets import Target
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import ROTATION_ONE
from quarc_ref.format.errors import BoundError
from quarc_ref.format.records import LOG_SCALES, OPACITY, SH_DC, SH_REST

_ROUNDING_FACTOR = 1 + 1e-5  # loosens bounds for rounding errors of floats and Q22


@dataclass(frozen=True, slots=True)
class Errors:
    """Largest error of each attribute in a frame, in the units of `Bounds`.

    The errors of a position and a rotation are divided by the slack of their Gaussian.
    """

    position: float = 0.0
    rotation: float = 0.0
    log_scale: float = 0.0
    opacity: float = 0.0
    sh_dc: float = 0.0
    sh_rest: float = 0.0

    def maximum(self, other: "Errors") -> "Errors":
        """Return the larger of two errors for each attribute."""
        names = [field.name for field in fields(self)]
        return Errors(*(max(getattr(self, name), getattr(other, name)) for name in names))


def measure_errors(scene: Scene, target: Target, rows: Int64) -> Errors:
    """Measure the errors of a decoded frame.

    Args:
        scene: The decoded scene.
        target: Gaussians from which the frame was encoded.
        rows: `[N]` row of the target for each Gaussian of the scene.
    """
    header = scene.header
    slack = target.slack.select(rows)
    position_errors = np.abs(target.positions[:, rows] - scene.positions) / slack.position
    rotation_errors = angles_between(scene.rotations / ROTATION_ONE, target.rotations[:, rows])
    rotation_errors = rotation_errors / slack.rotation
    code_errors = np.abs(target.codes[:, rows] - scene.codes).max(axis=1)
    return Errors(
        float(position_errors.max() * 2.0**-header.lattice_exponent),
        float(rotation_errors.max()),
        float(code_errors[LOG_SCALES].max() * header.log_scale_step),
        float(code_errors[OPACITY].max() * header.opacity_step),
        float(code_errors[SH_DC].max() * header.sh_dc_step),
        float(code_errors[SH_REST].max(initial=0) * header.sh_rest_step),
    )


def require_bounds(errors: Errors, bounds: Bounds, frame: int) -> None:
    """Check that the errors of a frame are within the bounds.

    Raises:
        BoundError: An error exceeds its bound.
    """
    for field in fields(errors):
        error, bound = getattr(errors, field.name), getattr(bounds, field.name)
        if error > bound * _ROUNDING_FACTOR:
            message = (
                f"frame {frame}: the largest error of {field.name} is {error:.6g}, above the "
                f"bound {bound:.6g}"
            )
            raise BoundError(message)
