"""What may be wrong with a stream, and at which stage of its making that is done."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Any


class Stage(Enum):
    """What a hostility changes."""

    SCENE = auto()
    """Gaussians of a canonical frame, before they are coded; knows the stream's header."""
    MOTION = auto()
    """Symbols of a frame's anchors, before they are coded; knows the state that has begun."""
    UPDATES = auto()
    """Updates of a frame, before they are coded; knows the state that has moved."""
    BIRTHS = auto()
    """Newborn of a frame, before they are coded; knows the state that has moved."""
    WRITER = auto()
    """What codes the planes of a section, made of what contexts have seen before."""
    CANONICAL = auto()
    """A canonical frame's record, coded, before its CRC is made."""
    SNAPSHOT = auto()
    """A snapshot's record, likewise."""
    FRAME = auto()
    """Another frame's record, likewise."""
    PAYLOAD = auto()
    """A frame's payload, its state's CRC included."""
    STREAM = auto()
    """All pieces of the stream."""
    BYTES = auto()
    """The stream."""


@dataclass(frozen=True, slots=True)
class Hostility:
    """One thing that is wrong.

    Attributes:
        name: What it is called.
        stage: What it changes.
        change: Takes draws, what is to be changed and what is known; returns it changed.
        header: Fields that the stream's header must have for it.
    """

    name: str
    stage: Stage
    change: Callable[..., Any]
    header: Mapping[str, Any] = field(default_factory=dict)
