"""A frame as SOG, version 2, by the library gaussforge; the axes are those of the PLY."""

from quarc_ref.export.clip import Clip, Frame
from quarc_ref.export.conversion import convert
from quarc_ref.export.gaussian_ply import build_ply


def build(frame: Frame, _clip: Clip) -> bytes:
    """Return the bytes of a file."""
    return convert(build_ply(frame.splats), "ply", "sog")
