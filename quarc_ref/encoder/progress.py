"""Interface of progress callbacks."""

from typing import Protocol


class Progress(Protocol):
    """Receives the progress of an encode."""

    def advance(self, stage: str, done: int, total: int) -> None:
        """Receive the number of completed steps of a stage, and its total number of steps."""
        ...


class NullProgress:
    """Ignores all progress."""

    def advance(self, stage: str, done: int, total: int) -> None:
        """See `Progress.advance`."""
