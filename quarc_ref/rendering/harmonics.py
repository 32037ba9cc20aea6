"""Evaluates SH of degrees 2 and 3, which other methods use; streams have at most degree 1.

The kernels evaluate degrees 0 and 1. Higher degrees are evaluated here for one camera and
passed to the kernels as SH DC. Basis and signs agree with 3DGS: real spherical harmonics
with the Condon-Shortley phase, in the order m = -l .. l.
"""

import numpy as np
from numpy.typing import NDArray

from quarc_ref.format.constants import SH_C0, SH_C1
from quarc_ref.rendering.pipeline_data import Float32

_SH_C2 = (1.0925484305920792, 0.31539156525252005, 0.5462742152960396)
_SH_C3 = (
    *(0.5900435899266435, 2.890611442640554, 0.4570457994644658),
    *(0.3731763325901154, 1.445305721320277),
)


def fold_harmonics(
    sh: Float32, positions: Float32, camera_position: NDArray[np.float64]
) -> Float32:
    """Convert SH of higher degrees to SH DC that gives the same colors for one camera.

    Args:
        sh: `[N, K, 3]` coefficients, where K is 9 or 16.
        positions: `[N, 3]` centers of the Gaussians, world units.
        camera_position: `[3]` camera position, world units.

    Returns:
        The SH DC, `[N, 1, 3]`.
    """
    offsets = positions - camera_position
    lengths = np.linalg.norm(offsets, axis=1, keepdims=True)
    directions = np.divide(offsets, lengths, out=np.zeros_like(offsets), where=lengths > 0)
    basis = evaluate_basis(directions)[:, : sh.shape[1]]
    colors = np.einsum("nk,nkc->nc", basis, sh.astype(np.float64))
    folded: Float32 = (colors / SH_C0).astype(np.float32)[:, None]
    return folded


def evaluate_basis(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the `[N, 16]` spherical harmonics of degrees 0 to 3 at unit directions `[N, 3]`."""
    x, y, z = directions.T
    xx, yy, zz = x * x, y * y, z * z
    a, b, c = _SH_C2
    d, e, f, g, h = _SH_C3
    return np.stack(
        [
            np.full_like(x, SH_C0),
            -SH_C1 * y,
            SH_C1 * z,
            -SH_C1 * x,
            a * x * y,
            -a * y * z,
            b * (2 * zz - xx - yy),
            -a * x * z,
            c * (xx - yy),
            -d * y * (3 * xx - yy),
            e * x * y * z,
            -f * y * (4 * zz - xx - yy),
            g * z * (2 * zz - 3 * xx - 3 * yy),
            -f * x * (4 * zz - xx - yy),
            h * z * (xx - yy),
            -d * x * (xx - 3 * yy),
        ],
        axis=1,
    )
