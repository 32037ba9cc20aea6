"""A frame to approximate, in the quantization steps of the stream."""

from dataclasses import dataclass, fields

import numpy as np

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.encoder.requantize import code_rotations
from quarc_ref.encoder.scenes.bounds import Bounds
from quarc_ref.encoder.scenes.rotations import Float64, normalize
from quarc_ref.encoder.scenes.slack import Slack, measure_slack
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import CODE_LIMIT, POSITION_LIMIT, ROTATION_ONE
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import Gaussians, StreamHeader


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """Gaussians in unrounded quantization steps, one column per Gaussian.

    Attributes:
        header: Header of the stream.
        positions: `[3, N]` positions, lattice units.
        rotations: `[4, N]` unit quaternions wxyz.
        codes: `[code_planes, N]` attributes in their steps, in the order of the state's codes.
        slack: Factors of the bounds of each Gaussian.
    """

    header: StreamHeader
    positions: Float64
    rotations: Float64
    codes: Float64
    slack: Slack

    @property
    def count(self) -> int:
        """Number of Gaussians, N."""
        return int(self.positions.shape[1])

    def coded(self, rows: Int64) -> Gaussians:
        """Return Gaussians rounded to the form that canonical frames code."""
        header = self.header
        fixed = np.rint(self.rotations[:, rows] * ROTATION_ONE).astype(np.int64)
        return Gaussians(
            np.rint(self.positions[:, rows] / header.position_step).astype(np.int64),
            code_rotations(fixed, header.rotation_bits),
            np.rint(self.codes[:, rows]).astype(np.int64),
        )


def make_target(splats: Splats, header: StreamHeader, bounds: Bounds) -> Target:
    """Convert a frame to the steps of a stream, with SH up to its degree.

    Args:
        splats: The frame.
        header: Header of the stream.
        bounds: Bounds after `Bounds.resolved`.

    Raises:
        EncodeError: A number is not finite, or out of the format's range.
    """
    for field in fields(splats):
        if not np.isfinite(getattr(splats, field.name)).all():
            message = f"{field.name} has a non-finite number"
            raise EncodeError(message)
    count, coefficients = len(splats.positions), (header.sh_degree and 4) or 1
    if not count or splats.sh.shape[1] < coefficients:
        message = (
            "there are no Gaussians"
            if not count
            else "the frame has a lower SH degree than the first one"
        )
        raise EncodeError(message)
    codes = [
        splats.log_scales / np.float64(header.log_scale_step),
        splats.opacities[:, None] / np.float64(header.opacity_step),
        splats.sh[:, 0] / np.float64(header.sh_dc_step),
        splats.sh[:, 1:coefficients].reshape(count, -1) / np.float64(header.sh_rest_step),
    ]
    target = Target(
        header,
        splats.positions.T.astype(np.float64) * 2.0**header.lattice_exponent,
        normalize(splats.rotations.T.astype(np.float64)),
        np.hstack(codes).T,
        measure_slack(splats, bounds),
    )
    _require(target.positions, POSITION_LIMIT - header.position_step, "a position")
    _require(target.codes, CODE_LIMIT - 1, "an attribute")
    return target


def _require(numbers: Float64, limit: int, what: str) -> None:
    if np.abs(numbers).max() > limit:
        message = f"{what} exceeds {limit} steps: allow larger errors"
        raise EncodeError(message)
