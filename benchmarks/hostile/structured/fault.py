"""Defines a fault of a stream, and the stages at which faults are applied."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Any


class Stage(Enum):
    """The part of a stream that a fault changes."""

    SCENE = auto()
    """Gaussians of a canonical frame before coding; the context is the stream's header."""
    MOTION = auto()
    """Symbols of a frame's anchors before coding; the context is the frame start."""
    UPDATES = auto()
    """Updates of a frame before coding; the context is the moved frame."""
    BIRTHS = auto()
    """Births of a frame before coding; the context is the moved frame."""
    WRITER = auto()
    """The writer of a section's planes; the value is the initial counts of the contexts."""
    CANONICAL = auto()
    """The coded record of a canonical frame, before its CRC is computed."""
    SNAPSHOT = auto()
    """The coded record of a snapshot, before its CRC is computed."""
    FRAME = auto()
    """The coded record of any other frame, before its CRC is computed."""
    PAYLOAD = auto()
    """The payload of a frame, including its state CRC."""
    STREAM = auto()
    """All pieces of the stream."""
    BYTES = auto()
    """The bytes of the stream."""


@dataclass(frozen=True, slots=True)
class Fault:
    """A kind of fault.

    Attributes:
        name: Name of the fault.
        stage: The part of the stream that the fault changes.
        change: Returns the changed value, given a `RecordGenerator`, the value and the context of
            the stage.
        header: Names and values of header fields that the fault requires.
    """

    name: str
    stage: Stage
    change: Callable[..., Any]
    header: Mapping[str, Any] = field(default_factory=dict)
