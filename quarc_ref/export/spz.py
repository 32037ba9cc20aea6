"""A frame as SPZ, version 3, by the library gaussforge.

SPZ has its axes fixed: x right, y up, z back. Positions are in steps of 2^-12
and within 2048 of the origin, all else is 8 bits or fewer.
"""

from quarc_ref.export.clip import Clip, Frame
from quarc_ref.export.conversion import convert_ply
from quarc_ref.export.errors import ExportError
from quarc_ref.export.gaussian_ply import build_ply
from quarc_ref.export.upright import rotate_upright

_FARTHEST = 2048 - 2**-12


def build(frame: Frame, clip: Clip) -> bytes:
    """Return the bytes of a file.

    Raises:
        ExportError: A Gaussian is farther off the origin than SPZ can say.
    """
    upright = rotate_upright(frame.splats, clip)
    if abs(upright.positions).max() > _FARTHEST:
        message = f"frame {frame.scene.frame} reaches beyond {_FARTHEST:.0f} units: SPZ does not"
        raise ExportError(message)
    return convert_ply(build_ply(upright), "spz", spz_version=3)
