"""Possible faults of a stream, and the stages at which they are applied."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Any


class Stage(Enum):
    """The part of a stream that a hostility changes."""

    SCENE = auto()
    """Gaussians of a canonical frame before coding; known: the stream's header."""
    MOTION = auto()
    """Symbols of a frame's anchors before coding; known: the frame start."""
    UPDATES = auto()
    """Updates of a frame before coding; known: the moved frame."""
    BIRTHS = auto()
    """Births of a frame before coding; known: the moved frame."""
    WRITER = auto()
    """The writer of the planes of a section, made from the previous counts of contexts."""
    CANONICAL = auto()
    """The coded record of a canonical frame, before its CRC is computed."""
    SNAPSHOT = auto()
    """The record of a snapshot, likewise."""
    FRAME = auto()
    """The record of another frame, likewise."""
    PAYLOAD = auto()
    """The payload of a frame, including its state CRC."""
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
