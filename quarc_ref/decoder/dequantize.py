"""From the integer state to the numbers that are drawn: SPEC 10.

The only floats of the decoder, one rounding from the state; nothing of them
feeds the next frame.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.decoder.scene import Scene
from quarc_ref.format.acceleration import load_kernels
from quarc_ref.format.arrays import Int16, Int32
from quarc_ref.format.constants import ROTATION_FRACTION_BITS, SH_DC_PLANES, SH_REST_PLANES
from quarc_ref.format.records import LOG_SCALES, OPACITY, SH_DC

Float32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Splats:
    """A scene in floats, a row to a Gaussian; as 3DGS stores it, not activated.

    Attributes:
        positions: `[N, 3]` xyz, world units.
        rotations: `[N, 4]` wxyz; unit to within 2^-21.
        log_scales: `[N, 3]` natural logarithm of the standard deviations, world units.
        opacities: `[N]` logits.
        sh: `[N, 1 or 4, 3]` coefficient, then red, green, blue.
    """

    positions: Float32
    rotations: Float32
    log_scales: Float32
    opacities: Float32
    sh: Float32


def dequantize(scene: Scene) -> Splats:
    """Return the numbers that a scene stands for, in arrays of their own."""
    return Dequantizer(1)(scene)


class Dequantizer:
    """Does as `dequantize`, into arrays that are used again.

    What is made of codes that are those of the scene before, as they are in a
    frame without births and deaths, is handed out again as it is.

    Args:
        last: How many scenes the arrays of one last, it included: those of a
            scene are overwritten by the `last`-th after it.
    """

    def __init__(self, last: int) -> None:
        self._moving = _Ring(last, (3, 4))
        self._coded = _Ring(last, (3, 1, SH_DC_PLANES, SH_DC_PLANES + SH_REST_PLANES))
        self._codes: Int16 | None = None
        self._attributes: tuple[Float32, ...] = ()

    def __call__(self, scene: Scene) -> Splats:
        """Return the numbers that a scene stands for."""
        if scene.codes is not self._codes:
            self._codes, self._attributes = scene.codes, self._dequantize_codes(scene)
        positions, rotations = self._moving.take(scene.count)
        _scale(scene.positions, [2.0**-scene.header.lattice_exponent] * 3, positions)
        _scale(scene.rotations, [2.0**-ROTATION_FRACTION_BITS] * 4, rotations)
        return Splats(positions, rotations, *self._attributes)

    def _dequantize_codes(self, scene: Scene) -> tuple[Float32, ...]:
        header, codes = scene.header, scene.codes
        log_scales, opacities, base, both = self._coded.take(scene.count)
        sh = both if header.sh_degree else base
        steps = [header.sh_dc_step] * SH_DC_PLANES + [header.sh_rest_step] * SH_REST_PLANES
        _scale(codes[LOG_SCALES], [header.log_scale_step] * 3, log_scales)
        _scale(codes[OPACITY], [header.opacity_step], opacities)
        _scale(codes[SH_DC.start :], steps[: sh.shape[1]], sh)
        return log_scales, opacities[:, 0], sh.reshape(scene.count, -1, SH_DC_PLANES)


class _Ring:
    """Sets of arrays that are handed out in turn; a row to a Gaussian."""

    def __init__(self, sets: int, columns: tuple[int, ...]) -> None:
        self._columns = columns
        self._sets: list[list[Float32]] = [[] for _ in range(sets)]

    def take(self, count: int) -> list[Float32]:
        """Return the first `count` rows of the arrays whose turn it is."""
        arrays = self._sets.pop(0)
        if not arrays or arrays[0].shape[0] < count:
            arrays = [np.empty((count, columns), np.float32) for columns in self._columns]
        self._sets.append(arrays)
        return [array[:count] for array in arrays]


def _scale(planes: Int16 | Int32, steps: list[float], rows: Float32) -> None:
    """Write planes `[r, N]`, each times its step, to rows; both factors are exact in binary32."""
    factors = np.array(steps, dtype=np.float32)
    kernels = load_kernels(_KERNELS, planes.shape[1])
    if kernels is None:
        rows[:] = planes.T.astype(np.float32) * factors
    else:
        kernels.scale(planes, factors, rows)


_KERNELS = "quarc_ref.decoder.float_kernels"
