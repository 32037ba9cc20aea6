"""The input Gaussians of a frame, converted to the quantization steps of the stream."""

from dataclasses import dataclass, fields

import numpy as np

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.encoder.rotations import Float64, code_quaternions, normalize
from quarc_ref.encoder.scenes.bounds import Bounds
from quarc_ref.encoder.scenes.slack import Slack, measure_slack
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import CODE_LIMIT, POSITION_LIMIT
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import Gaussians, StreamHeader

_SH_COEFFICIENT_COUNTS = (1, 4, 9, 16)  # of degrees 0 to 3


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """Gaussians that a frame approximates, in unrounded quantization steps.

    Attributes:
        header: Header of the stream.
        positions: `[3, N]` positions, lattice units.
        rotations: `[4, N]` unit quaternions wxyz.
        codes: `[code_planes, N]` attributes in quantization steps, in the order of `Scene.codes`.
        slack: Factors by which the error bounds of each Gaussian are multiplied.
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

    def quantized(self, rows: Int64) -> Gaussians:
        """Return the Gaussians of the given rows, rounded to the grid of canonical frames."""
        header = self.header
        return Gaussians(
            np.rint(self.positions[:, rows] / header.position_step).astype(np.int64),
            code_quaternions(self.rotations[:, rows], header.rotation_bits),
            np.rint(self.codes[:, rows]).astype(np.int64),
        )


def require_encodable(splats: Splats, ids: Int64 | None) -> None:
    """Raise EncodeError if a frame cannot be encoded.

    Args:
        splats: Gaussians, which may have wrong shapes or numbers that are not finite, or be none.
        ids: Ids of the Gaussians, which may be repeated; None if they have none.
    """
    if not len(splats.positions):
        message = "the frame has no Gaussians"
        raise EncodeError(message)
    _require_shapes(splats)
    if ids is not None:
        _require_unique(ids, len(splats.positions))
    for field in fields(splats):
        if not np.isfinite(getattr(splats, field.name)).all():
            message = f"the field {field.name} contains a non-finite number"
            raise EncodeError(message)


def _require_shapes(splats: Splats) -> None:
    count, sh_shape = len(splats.positions), splats.sh.shape
    if sh_shape not in [(count, coefficients, 3) for coefficients in _SH_COEFFICIENT_COUNTS]:
        message = f"the field sh has the shape {sh_shape}, not ({count}, 1, 4, 9 or 16, 3)"
        raise EncodeError(message)
    shapes = {
        "positions": (count, 3),
        "rotations": (count, 4),
        "log_scales": (count, 3),
        "opacities": (count,),
    }
    for name, shape in shapes.items():
        found_shape = getattr(splats, name).shape
        if found_shape != shape:
            message = f"the field {name} has the shape {found_shape}, not {shape}"
            raise EncodeError(message)


def _require_unique(ids: Int64, count: int) -> None:
    is_integer = np.issubdtype(ids.dtype, np.integer)
    if ids.shape != (count,) or not is_integer or np.unique(ids).size != count:
        message = f"ids must be {count} different integers, one for each Gaussian"
        raise EncodeError(message)


def make_target(splats: Splats, header: StreamHeader, bounds: Bounds) -> Target:
    """Convert the Gaussians of a frame to the quantization steps of a stream, without rounding.

    Args:
        splats: Gaussians that `require_encodable` accepts; SH degrees above that of the stream are
            ignored.
        header: Header of the stream.
        bounds: Bounds that `Bounds.resolved` returned.

    Raises:
        EncodeError: The frame has a lower SH degree than the stream, or an attribute is out of the
            format's range.
    """
    codes = _count_steps(splats, header)
    for name, numbers in codes.items():
        _require_range(numbers, CODE_LIMIT - 1, name)
    target = Target(
        header,
        splats.positions.T.astype(np.float64) * 2.0**header.lattice_exponent,
        normalize(splats.rotations.T.astype(np.float64)),
        np.hstack(list(codes.values())).T,
        measure_slack(splats, bounds),
    )
    _require_range(target.positions.T, POSITION_LIMIT - header.position_step, "position")
    return target


def _count_steps(splats: Splats, header: StreamHeader) -> dict[str, Float64]:
    """Return the attributes in unrounded quantization steps, `[N, components]`, by name."""
    count, coefficient_count = len(splats.positions), (header.sh_degree and 4) or 1
    if splats.sh.shape[1] < coefficient_count:
        message = "the frame has a lower SH degree than the first frame"
        raise EncodeError(message)
    sh_rest = splats.sh[:, 1:coefficient_count].reshape(count, -1)
    return {
        "log_scale": splats.log_scales / np.float64(header.log_scale_step),
        "opacity": splats.opacities[:, None] / np.float64(header.opacity_step),
        "sh_dc": splats.sh[:, 0] / np.float64(header.sh_dc_step),
        "sh_rest": sh_rest / np.float64(header.sh_rest_step),
    }


def _require_range(numbers: Float64, limit: int, attribute: str) -> None:
    """Raise EncodeError if an attribute, `[N, components]` in steps, is out of range."""
    largest = np.abs(numbers).max(axis=1, initial=0)
    if (largest > limit).any():
        message = (
            f"the {attribute} of Gaussian {largest.argmax()} exceeds {limit} steps: remove the "
            f"Gaussian, or allow larger errors of {attribute}"
        )
        raise EncodeError(message)
