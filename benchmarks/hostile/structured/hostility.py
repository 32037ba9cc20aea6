"""Possible faults of a stream, and the stages at which they are applied."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Any


class Stage(Enum):
    """The part of a stream that a hostility changes."""

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
    """A kind of fault.

    Attributes:
        name: Name of the fault.
        stage: What it changes.
        change: Changes a value; takes random values, the value and the known state.
        header: Fields that the stream's header must have.
    """

    name: str
    stage: Stage
    change: Callable[..., Any]
    header: Mapping[str, Any] = field(default_factory=dict)
