"""Interface for progress reports."""

from typing import Protocol


class Progress(Protocol):
    """Called after every step of the encoder."""

    def advance(self, stage: str, done: int, total: int) -> None:
        """Receive the number of completed steps of a stage."""
        ...


class NullProgress:
    """Discards progress."""

    def advance(self, stage: str, done: int, total: int) -> None:
        """See `Progress.advance`."""
