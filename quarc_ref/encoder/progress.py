"""Progress of long work."""

from typing import Protocol


class Progress(Protocol):
    """Called after every step of the encoder."""

    def advance(self, stage: str, done: int, total: int) -> None:
        """`done` of `total` steps of a stage are complete."""
        ...


class NullProgress:
    """Discards progress."""

    def advance(self, stage: str, done: int, total: int) -> None:
        """See `Progress.advance`."""
