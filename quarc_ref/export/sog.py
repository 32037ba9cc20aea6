"""Exports a frame as SOG version 2 with the library gaussforge, without changing the axes."""

from quarc_ref.export.clip import Clip, Frame
from quarc_ref.export.conversion import convert
from quarc_ref.export.gaussian_ply import build_ply


def build(frame: Frame, _clip: Clip) -> bytes:
    """Build the SOG file of a frame."""
    return convert(build_ply(frame.splats), "ply", "sog")
