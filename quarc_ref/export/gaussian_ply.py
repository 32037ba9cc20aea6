"""A frame as the PLY file of 3DGS, which every splat viewer opens.

Scales are natural logarithms, opacities logits, quaternions wxyz; SH rest is
stored channel by channel, all of red first. The file says nothing of axes: the
coordinates are the stream's (SPEC 10, Annex on mappings).
"""

import numpy as np
from numpy.typing import NDArray

from quarc_ref.decoder.dequantize import Splats


def build_ply(splats: Splats) -> bytes:
    """Return the bytes of a binary little-endian PLY."""
    columns = _columns(splats)
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(splats.positions)}"]
    header += [f"property float {name}" for name in columns]
    rows = np.stack(list(columns.values()), axis=1).astype("<f4")
    return "\n".join([*header, "end_header", ""]).encode() + rows.tobytes()


def _columns(splats: Splats) -> dict[str, NDArray[np.float32]]:
    count, coefficients, _ = splats.sh.shape
    rest = splats.sh[:, 1:].transpose(0, 2, 1).reshape(count, 3 * (coefficients - 1))
    groups = {
        ("x", "y", "z"): splats.positions,
        ("nx", "ny", "nz"): np.zeros_like(splats.positions),
        tuple(f"f_dc_{i}" for i in range(3)): splats.sh[:, 0],
        tuple(f"f_rest_{i}" for i in range(rest.shape[1])): rest,
        ("opacity",): splats.opacities[:, None],
        tuple(f"scale_{i}" for i in range(3)): splats.log_scales,
        tuple(f"rot_{i}" for i in range(4)): splats.rotations,
    }
    return {
        name: array[:, column]
        for names, array in groups.items()
        for column, name in enumerate(names)
    }
