"""Writes and reads frames as 3DGS PLY files (SPEC Annex C.1), the common format of splat viewers.

Scales are natural logarithms, opacities are logits, and quaternions are wxyz. SH rest is stored
channel by channel, red first. The format does not define axes, so the coordinates of the stream are
written unchanged.
"""

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.ply_table import build_ply_table, parse_ply_header, read_ply_columns
from quarc_ref.decoder.dequantize import Splats
from quarc_ref.export.clip import Clip, Frame


def build(frame: Frame, _clip: Clip) -> bytes:
    """Build the PLY file of a frame."""
    return build_ply(frame.splats)


_SH_REST_COUNTS = (0, 9, 24, 45)
_REQUIRED_PROPERTIES = (
    *("x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2"),
    *("rot_0", "rot_1", "rot_2", "rot_3"),
)


def build_ply(splats: Splats) -> bytes:
    """Build a binary little-endian PLY file."""
    columns = _list_columns(splats)
    rows = np.empty(len(splats.positions), dtype=[(name, "<f4") for name in columns])
    for name, column in columns.items():
        rows[name] = column
    return build_ply_table(rows)


def _list_columns(splats: Splats) -> dict[str, NDArray[np.float32]]:
    gaussian_count, coefficient_count, _ = splats.sh.shape
    sh_rest = (
        splats.sh[:, 1:].transpose(0, 2, 1).reshape(gaussian_count, 3 * (coefficient_count - 1))
    )
    array_by_names = {
        ("x", "y", "z"): splats.positions,
        ("nx", "ny", "nz"): np.zeros_like(splats.positions),
        tuple(f"f_dc_{i}" for i in range(3)): splats.sh[:, 0],
        tuple(f"f_rest_{i}" for i in range(sh_rest.shape[1])): sh_rest,
        ("opacity",): splats.opacities[:, None],
        tuple(f"scale_{i}" for i in range(3)): splats.log_scales,
        tuple(f"rot_{i}" for i in range(4)): splats.rotations,
    }
    return {
        name: array[:, column]
        for names, array in array_by_names.items()
        for column, name in enumerate(names)
    }


def parse_ply(data: bytes) -> Splats:
    """Parse a 3DGS PLY file.

    Args:
        data: Bytes of the file: ASCII or binary little-endian, with SH of degree 0 to 3.

    Returns:
        The Gaussians, with unit quaternions and `sh` `[N, K, 3]`, where K is 1, 4, 9 or 16.

    Raises:
        ValueError: The file is not a valid PLY file of Gaussians, or a number is not finite.
    """
    header = parse_ply_header(data)
    rest_count = sum(name.startswith("f_rest_") for name in header.property_types)
    if rest_count not in _SH_REST_COUNTS:
        allowed_counts = ", ".join(map(str, _SH_REST_COUNTS))
        message = (
            f"the file has {rest_count} properties f_rest_*, but SH of degree 0 to 3 have "
            f"{allowed_counts}"
        )
        raise ValueError(message)
    names = [*_REQUIRED_PROPERTIES, *_name_rest_properties(rest_count)]
    invalid_names = [name for name in names if header.property_types.get(name) not in ("f4", "f8")]
    if invalid_names:
        message = (
            f"the file is not a PLY file of 3D Gaussians: its vertices have no property "
            f"{invalid_names[0]} of type float or double"
        )
        raise ValueError(message)
    columns = read_ply_columns(data, header)
    return _build_splats({name: _to_float32(name, columns[name]) for name in names}, rest_count)


def _build_splats(columns: dict[str, NDArray[np.float32]], rest_count: int) -> Splats:
    def stack(*names: str) -> NDArray[np.float32]:
        return np.stack([columns[name] for name in names], axis=1)

    rotations = stack(*(f"rot_{i}" for i in range(4)))
    lengths = np.linalg.norm(rotations.astype(np.float64), axis=1, keepdims=True)
    if not lengths.all():
        message = "a rotation in the file is the zero quaternion"
        raise ValueError(message)
    gaussian_count = len(rotations)
    sh = stack(*(f"f_dc_{i}" for i in range(3)))[:, None]
    if rest_count:
        channel_rest = stack(*_name_rest_properties(rest_count)).reshape(
            gaussian_count, 3, rest_count // 3
        )
        sh = np.concatenate([sh, channel_rest.transpose(0, 2, 1)], axis=1)
    return Splats(
        stack("x", "y", "z"),
        (rotations / lengths).astype(np.float32),
        stack(*(f"scale_{i}" for i in range(3))),
        columns["opacity"],
        np.ascontiguousarray(sh),
    )


def _to_float32(name: str, column: NDArray[np.generic]) -> NDArray[np.float32]:
    with np.errstate(over="ignore"):
        numbers = np.ascontiguousarray(column, dtype=np.float32)
    invalid_rows = np.flatnonzero(~np.isfinite(numbers))
    if invalid_rows.size:
        row = int(invalid_rows[0])
        message = f"{name} of Gaussian {row} is {column[row]}, which is not a finite float32 number"
        raise ValueError(message)
    return numbers


def _name_rest_properties(rest_count: int) -> list[str]:
    return [f"f_rest_{i}" for i in range(rest_count)]
