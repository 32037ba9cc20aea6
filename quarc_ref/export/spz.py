"""Writes SPZ version 3 and reads versions 1 to 4 by the library gaussforge.

SPZ defines its axes: x right, y up, z back. Positions have steps of 2^-12 and a range of
2048 around the origin; other attributes have at most 8 bits.
"""

import zlib

import numpy as np

from quarc_ref.datasets.ply_table import parse_ply_header
from quarc_ref.decoder.dequantize import Splats
from quarc_ref.export.clip import Clip, Frame
from quarc_ref.export.conversion import convert, convert_in_subprocess
from quarc_ref.export.errors import ExportError
from quarc_ref.export.gaussian_ply import build_ply, parse_ply
from quarc_ref.export.upright import rotate_upright

_FIRMEST = 10.0  # logit of an opacity slightly below 1
UP_AXIS = 3  # +y, as in a stream's header
_FARTHEST = 2048 - 2**-12
_MAGIC = b"NGSP"
_GZIP = b"\x1f\x8b"
_HEADER_BYTES = 16
_MAX_GAUSSIANS = 1 << 24
# minimum bytes per Gaussian before compression: 9 for the position, 7 for the rest
_MIN_BYTES = 16
_MAX_RATIO = 1032  # maximum ratio of deflate


def build(frame: Frame, clip: Clip) -> bytes:
    """Build the file of a frame.

    Raises:
        ExportError: A Gaussian is too far from the origin for SPZ.
    """
    upright = rotate_upright(frame.splats, clip)
    if abs(upright.positions).max() > _FARTHEST:
        message = (
            f"frame {frame.scene.frame} has positions beyond {_FARTHEST:.0f} units, the limit "
            "of SPZ"
        )
        raise ExportError(message)
    return convert(build_ply(upright), "ply", "spz", spz_version=3)


def parse_spz(data: bytes) -> Splats:
    """Parse the Gaussians of an SPZ file, in the axes of the file, with +y up.

    Opacities of 0 and 1, whose logits are infinite, are moved slightly inwards.

    Args:
        data: Bytes of the file.

    Raises:
        ValueError: The file is malformed.
        ImportError: gaussforge is not installed.
    """
    check_header(data)
    try:
        table = convert_in_subprocess(data, "spz", "ply")
    except ExportError as error:
        raise ValueError(str(error)) from error
    header = parse_ply_header(table)
    rows = np.frombuffer(table, header.vertex_type, header.vertex_count, header.data_offset).copy()
    rows["opacity"] = np.clip(rows["opacity"], -_FIRMEST, _FIRMEST)
    return parse_ply(table[: header.data_offset] + rows.tobytes())


def check_header(data: bytes) -> None:
    """Check the number of Gaussians in a file's header against its size.

    Raises:
        ValueError: The file is not an SPZ file, or is too small for the Gaussians in its header.
    """
    head = data[:_HEADER_BYTES]
    if head[:2] == _GZIP:
        try:
            head = zlib.decompressobj(wbits=31).decompress(data, _HEADER_BYTES)
        except zlib.error as error:
            message = f"it is not an SPZ file: {error}"
            raise ValueError(message) from error
    if len(head) < _HEADER_BYTES or head[:4] != _MAGIC:
        message = "it does not begin with the header of an SPZ file"
        raise ValueError(message)
    count = int.from_bytes(head[8:12], "little")
    if not 0 < count <= min(_MAX_GAUSSIANS, len(data) * _MAX_RATIO // _MIN_BYTES):
        message = f"it is too short for the {count} Gaussians that its header states"
        raise ValueError(message)
