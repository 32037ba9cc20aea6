"""Defines faults of a stream, and the stages at which they are applied."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Any


class Stage(Enum):
    """A stage of generating a stream, at which a fault can change a value."""

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
    """A fault that can be put into a stream.

    Attributes:
        name: Name of the fault.
        stage: The stage at which the fault is applied.
        change: Function that returns the changed value; it gets a `RecordGenerator`, the value, and
            the context of the stage if it has one.
        header_fields: Values that the fault requires in header fields, by name of the field.
    """

    name: str
    stage: Stage
    change: Callable[..., Any]
    header_fields: Mapping[str, Any] = field(default_factory=dict)
