"""Playback: frames are decoded ahead, from any start frame."""

from quarc_ref.playback.frame_pipeline import Frame
from quarc_ref.playback.player import Player

__all__ = ["Frame", "Player"]
