"""A frame as SPZ, version 3, by the library gaussforge; versions 1 to 4 are read.

SPZ has its axes fixed: x right, y up, z back. Positions are in steps of 2^-12 and within 2048 of
the origin; other attributes have 8 bits or fewer.
"""

import zlib

import numpy as np

from quarc_ref.datasets.ply_table import parse_ply_header
from quarc_ref.decoder.dequantize import Splats
from quarc_ref.export.clip import Clip, Frame
from quarc_ref.export.conversion import convert, convert_apart
from quarc_ref.export.errors import ExportError
from quarc_ref.export.gaussian_ply import build_ply, parse_ply
from quarc_ref.export.upright import rotate_upright

_FIRMEST = 10.0  # logit of an opacity that is nearly 1
UP_AXIS = 3  # +y, as in a stream's header
_FARTHEST = 2048 - 2**-12
_MAGIC = b"NGSP"
_GZIP = b"\x1f\x8b"
_HEADER_BYTES = 16
_MOST_GAUSSIANS = 1 << 24
_LEAST_BYTES = 16  # of a Gaussian, before compression: 9 of a position, 7 of the rest and more
_MOST_RATIO = 1032  # of what deflate takes apart


def build(frame: Frame, clip: Clip) -> bytes:
    """Return the bytes of a file.

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
    """Return the Gaussians of an SPZ file, in the frame of the file: +y is up.

    Opacities of 0 and 1, whose logits are infinite, are moved slightly inwards.

    Args:
        data: The whole file.

    Raises:
        ValueError: The file is malformed.
        ImportError: gaussforge is not installed.
    """
    check_header(data)
    try:
        table = convert_apart(data, "spz", "ply")
    except ExportError as error:
        raise ValueError(str(error)) from error
    header = parse_ply_header(table)
    rows = np.frombuffer(table, header.row, header.count, header.start).copy()
    rows["opacity"] = np.clip(rows["opacity"], -_FIRMEST, _FIRMEST)
    return parse_ply(table[: header.start] + rows.tobytes())


def check_header(data: bytes) -> None:
    """Check the number of Gaussians that a file claims against its size.

    Raises:
        ValueError: The file is not SPZ, or is too small for the Gaussians it claims.
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
    if not 0 < count <= min(_MOST_GAUSSIANS, len(data) * _MOST_RATIO // _LEAST_BYTES):
        message = f"it is too short for the {count} Gaussians that its header states"
        raise ValueError(message)
