"""Writes SPZ version 3 and reads versions 1 to 4 with the library gaussforge.

SPZ defines the axes: +x points right, +y up and +z backward. Positions are stored in steps of 2^-12
units with a range of ±2048 units; each component of the other attributes has at most 10 bits.
"""

import zlib
from collections.abc import Iterator

import numpy as np

from quarc_ref.datasets.ply_table import parse_ply_header
from quarc_ref.decoder.dequantize import Splats
from quarc_ref.export.clip import Clip, Frame
from quarc_ref.export.conversion import convert, convert_in_subprocess
from quarc_ref.export.errors import ExportError
from quarc_ref.export.gaussian_ply import build_ply, parse_ply
from quarc_ref.export.upright import rotate_upright

_MAX_LOGIT = 10.0  # logit of an opacity slightly below 1
_MAX_COORDINATE = 2048 - 2**-12
_MAGIC = b"NGSP"
_GZIP_MAGIC = b"\x1f\x8b"
_HEADER_BYTES = 16
_MAX_GAUSSIANS = 1 << 24
# bytes of a Gaussian without SH rest before compression: 9 for the position, 7 for the others
_MIN_GAUSSIAN_BYTES = 16
_MAX_GAUSSIAN_BYTES = 92  # with SH of degree 4
_MAX_OTHER_BYTES = 1 << 20  # header and extensions
_MAX_DEFLATE_RATIO = 1032  # maximum compression ratio of deflate
_PIECE_BYTES = 1 << 14  # compressed


def build(frame: Frame, clip: Clip) -> bytes:
    """Build the SPZ file of a frame.

    Raises:
        ExportError: A Gaussian is outside the position range of SPZ.
    """
    upright_splats = rotate_upright(frame.splats, clip)
    if abs(upright_splats.positions).max() > _MAX_COORDINATE:
        message = (
            f"frame {frame.scene.frame} has positions beyond {_MAX_COORDINATE:.0f} units, the "
            "limit of SPZ"
        )
        raise ExportError(message)
    return convert(build_ply(upright_splats), "ply", "spz", spz_version=3)


def parse_spz(data: bytes) -> Splats:
    """Parse the Gaussians of an SPZ file; in the result, +y is up, as in the file.

    Opacity logits are clamped to ±10, because the logits of opacities 0 and 1 are infinite.

    Args:
        data: Bytes of the file.

    Raises:
        ValueError: The file is malformed.
        ImportError: The library gaussforge is not installed.
    """
    check_header(data)
    try:
        ply_data = convert_in_subprocess(data, "spz", "ply")
    except ExportError as error:
        raise ValueError(str(error)) from error
    header = parse_ply_header(ply_data)
    rows = np.frombuffer(
        ply_data, header.vertex_type, header.vertex_count, header.data_offset
    ).copy()
    rows["opacity"] = np.clip(rows["opacity"], -_MAX_LOGIT, _MAX_LOGIT)
    return parse_ply(ply_data[: header.data_offset] + rows.tobytes())


def check_header(data: bytes) -> None:
    """Check that the size of a file fits the number of Gaussians in its header.

    Raises:
        ValueError: The file is not an SPZ file, or is too small or, decompressed, too large for the
            Gaussians in its header.
    """
    header = data[:_HEADER_BYTES]
    is_gzip = header[:2] == _GZIP_MAGIC
    if is_gzip:
        header = next(_decompress(data), b"")[:_HEADER_BYTES]
    if len(header) < _HEADER_BYTES or header[:4] != _MAGIC:
        message = "the file does not begin with an SPZ header"
        raise ValueError(message)
    gaussian_count = int.from_bytes(header[8:12], "little")
    max_count = min(_MAX_GAUSSIANS, len(data) * _MAX_DEFLATE_RATIO // _MIN_GAUSSIAN_BYTES)
    if not 0 < gaussian_count <= max_count:
        message = (
            f"the file is too short for the {gaussian_count} Gaussians that its header declares"
        )
        raise ValueError(message)
    if is_gzip:
        _require_bounded_size(data, _MAX_OTHER_BYTES + gaussian_count * _MAX_GAUSSIAN_BYTES)


def _require_bounded_size(data: bytes, max_bytes: int) -> None:
    """Reject a file that decompresses to so much that the library would use up the memory."""
    size = 0
    for piece in _decompress(data):
        size += len(piece)
        if size > max_bytes:
            message = f"the file decompresses to more than {max_bytes} bytes, its maximum size"
            raise ValueError(message)


def _decompress(data: bytes) -> Iterator[bytes]:
    """Yield the pieces of a gzip file, until it ends or is truncated."""
    decompressor = zlib.decompressobj(wbits=31)
    for start in range(0, len(data), _PIECE_BYTES):
        if decompressor.eof:
            return
        try:
            yield decompressor.decompress(data[start : start + _PIECE_BYTES])
        except zlib.error as error:
            message = f"the file is not an SPZ file: {error}"
            raise ValueError(message) from error
