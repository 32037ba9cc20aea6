"""How long work tells how far it is."""

from typing import Protocol


class Progress(Protocol):
    """Is told of every step of the encoder."""

    def advance(self, stage: str, done: int, total: int) -> None:
        """Note that `done` of `total` steps of a stage are done."""
        ...


class NullProgress:
    """Tells nobody."""

    def advance(self, stage: str, done: int, total: int) -> None:
        """See `Progress.advance`."""
