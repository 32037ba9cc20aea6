"""Plays streams from any frame, and decodes frames in advance."""

from quarc_ref.playback.frame_pipeline import Frame
from quarc_ref.playback.player import Player

__all__ = ["Frame", "Player"]
