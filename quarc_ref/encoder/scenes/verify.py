"""Compares a decoded frame with the Gaussians that it was encoded from."""

from dataclasses import dataclass, fields

import numpy as np

from quarc_ref.decoder.scene import Scene
from quarc_ref.encoder.scenes.bounds import Bounds
from quarc_ref.encoder.scenes.rotations import angles_between
from quarc_ref.encoder.scenes.targets import Target
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import ROTATION_ONE
from quarc_ref.format.errors import BoundError
from quarc_ref.format.records import LOG_SCALES, OPACITY, SH_DC, SH_REST

_ROUNDING = 1 + 1e-5  # tolerance for rounding errors of floats and Q22


@dataclass(frozen=True, slots=True)
class Errors:
    """Largest errors of a frame, in the units of `Bounds`.

    Errors of positions and rotations are divided by the slack of their Gaussians.
    """

    position: float = 0.0
    rotation: float = 0.0
    log_scale: float = 0.0
    opacity: float = 0.0
    sh_dc: float = 0.0
    sh_rest: float = 0.0

    def joined(self, other: "Errors") -> "Errors":
        """Return the maximum of each error."""
        names = [field.name for field in fields(self)]
        return Errors(*(max(getattr(self, name), getattr(other, name)) for name in names))


def measure_errors(scene: Scene, target: Target, rows: Int64) -> Errors:
    """Measure the errors of a decoded frame.

    Args:
        scene: The decoded scene.
        target: The target frame.
        rows: `[N]` row of the target of each Gaussian of the scene.
    """
    header = scene.header
    slack = target.slack.rows(rows)
    apart = (np.abs(target.positions[:, rows] - scene.positions) / slack.position).max()
    turned = angles_between(scene.rotations / ROTATION_ONE, target.rotations[:, rows])
    turned = (turned / slack.rotation).max()
    codes = np.abs(target.codes[:, rows] - scene.codes).max(axis=1)
    return Errors(
        float(apart * 2.0**-header.lattice_exponent),
        float(turned),
        float(codes[LOG_SCALES].max() * header.log_scale_step),
        float(codes[OPACITY].max() * header.opacity_step),
        float(codes[SH_DC].max() * header.sh_dc_step),
        float(codes[SH_REST].max(initial=0) * header.sh_rest_step),
    )


def require_bounds(errors: Errors, bounds: Bounds, frame: int) -> None:
    """Check that the errors of a frame are within the bounds.

    Raises:
        BoundError: An error exceeds its bound.
    """
    for field in fields(errors):
        error, bound = getattr(errors, field.name), getattr(bounds, field.name)
        if error > bound * _ROUNDING:
            message = (
                f"frame {frame}: an error of {field.name} is {error:.6g}, above its bound "
                f"{bound:.6g}"
            )
            raise BoundError(message)
