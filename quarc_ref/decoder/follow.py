"""Waiting for a stream that still grows: SPEC 11.3."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from quarc_ref.format.errors import TruncatedError

_Answer = TypeVar("_Answer")


@dataclass(frozen=True, slots=True)
class Follow:
    """How long to wait for what is still to be written.

    Attributes:
        poll: Seconds from one look to the next.
        patience: Seconds without a new whole chunk after which the stream
            counts as cut.
    """

    poll: float = 0.1
    patience: float = 10.0


def ask(action: Callable[[], _Answer], follow: Follow | None) -> _Answer:
    """Do what needs more of a stream than there may be yet.

    Args:
        action: Leaves everything as it was where the stream ends too early.
        follow: How long to wait; None not to wait at all.

    Returns:
        What the action returns.

    Raises:
        TruncatedError: The stream ended too early for too long.
    """
    if follow is None:
        return action()
    give_up = time.monotonic() + follow.patience
    while True:
        try:
            return action()
        except TruncatedError:
            if time.monotonic() >= give_up:
                raise
        time.sleep(follow.poll)
