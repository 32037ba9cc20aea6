"""What a page draws of a frame: centers, covariances, opacities, colors of an eye.

Covariances go to the page in half precision, which holds them from 6e-8 to
65504 only: they are counted in a unit of the scene's own, a power of two about
as long as the median Gaussian is wide. Arithmetic runs over planes `[3, N]`,
several times as fast as over rows.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.decoder import Splats

Float16 = NDArray[np.float16]
Float32 = NDArray[np.float32]
Bytes = NDArray[np.uint8]

_HALF_MOST = 6e4
_OPACITY_MOST = 0.99
_UNIT_BITS = 60  # beyond, positions are not in float32 what they are
_LOG_VARIANCE_MOST = np.float32(60)
_SH_0 = np.float32(0.28209479177387814)  # SPEC 10.2
_SH_1 = np.float32(0.4886025119029199)


@dataclass(frozen=True, slots=True, eq=False)
class SplatFrame:
    """The Gaussians of one frame.

    Attributes:
        unit: World units to one of `centers`.
        centers: `[N, 3]` units.
        covariances: `[N, 3, 3]` square units.
        opacities: `[N, 1]` 0 to 255.
        sh: `[1 or 4, 3, N]` coefficient, then red, green, blue.
    """

    unit: float
    centers: Float32
    covariances: Float16
    opacities: Bytes
    sh: Float16

    @property
    def count(self) -> int:
        """Number of Gaussians."""
        return int(self.centers.shape[0])

    @property
    def nbytes(self) -> int:
        """Memory that the frame takes."""
        arrays = (self.centers, self.covariances, self.opacities, self.sh)
        return sum(array.nbytes for array in arrays)

    def shade(self, eye: Float32) -> Bytes:
        """Return `[N, 3]` the colors that an eye at `[3]`, world units, sees."""
        colors = _SH_0 * self.sh[0].astype(np.float32) + np.float32(0.5)
        if self.sh.shape[0] > 1:
            sh = self.sh.astype(np.float32)
            with np.errstate(over="ignore", invalid="ignore"):  # of an eye out of all bounds
                x, y, z = self.centers.T - np.asarray(eye / self.unit, np.float32)[:, None]
                scale = _SH_1 / np.sqrt(np.maximum(x * x + y * y + z * z, np.float32(1e-12)))
                colors += scale * (z * sh[2] - y * sh[1] - x * sh[3])
            np.nan_to_num(colors, copy=False)
        rounded = np.clip(colors, 0, 1) * 255 + np.float32(0.5)
        return np.ascontiguousarray(rounded.astype(np.uint8).T)


def choose_unit(splats: Splats) -> float:
    """Return the unit, in world units, that a stream with this frame is shown in."""
    bits = round(float(np.median(splats.log_scales)) / math.log(2))
    return 2.0 ** max(-_UNIT_BITS, min(bits, _UNIT_BITS))


def make_splats(splats: Splats, unit: float) -> SplatFrame:
    """Return what is drawn of a scene, in arrays of its own.

    Args:
        splats: The scene in floats.
        unit: From `choose_unit`.
    """
    opacities = np.minimum(1 / (1 + np.exp(-np.maximum(splats.opacities, -60))), _OPACITY_MOST)
    return SplatFrame(
        unit,
        splats.positions / np.float32(unit),
        _measure_covariances(splats, unit),
        (opacities * 255 + 0.5).astype(np.uint8)[:, None],
        np.ascontiguousarray(_to_half(splats.sh.transpose(1, 2, 0))),
    )


def _measure_covariances(splats: Splats, unit: float) -> Float16:
    """Return `[N, 3, 3]` R S S R^T in square units."""
    axes = _axes(np.ascontiguousarray(splats.rotations.T))
    log_variances = 2 * (splats.log_scales.T - np.float32(math.log(unit)))
    variances = np.exp(np.minimum(log_variances, _LOG_VARIANCE_MOST))
    covariances = np.empty((splats.positions.shape[0], 3, 3), dtype=np.float16)
    for i in range(3):
        for j in range(i, 3):
            terms = sum(variances[k] * axes[i][k] * axes[j][k] for k in range(3))
            covariances[:, i, j] = covariances[:, j, i] = _to_half(terms)
    return covariances


def _to_half(numbers: Float32) -> Float16:
    return np.clip(numbers, -_HALF_MOST, _HALF_MOST).astype(np.float16)


def _axes(quaternions: Float32) -> tuple[tuple[Float32, ...], ...]:
    """Return the rows of the rotation matrices, `[N]` each, of unit quaternions `[4, N]` wxyz."""
    w, x, y, z = quaternions
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
