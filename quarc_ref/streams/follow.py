"""Waits for growing streams: SPEC 11.3."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from quarc_ref.format.errors import TruncatedError

_Result = TypeVar("_Result")


@dataclass(frozen=True, slots=True)
class Follow:
    """How to wait for a growing stream.

    Attributes:
        interval: Seconds between polls.
        patience: Seconds without a new complete chunk after which the stream is considered
            truncated. In a search for a chunk after damage, any new byte counts.
    """

    interval: float = 0.1
    patience: float = 10.0


def poll(action: Callable[[], _Result], follow: Follow | None) -> _Result:
    """Retry a read until a growing stream has enough bytes for it.

    Args:
        action: Function that reads and can be repeated if the stream ends too early. The offset of
            its error says how far it has come: waiting starts again whenever this offset grows.
        follow: How often and how long to retry; None to try once.

    Returns:
        The result of the action.

    Raises:
        TruncatedError: The stream did not grow in time.
    """
    if follow is None:
        return action()
    deadline, furthest_offset = 0.0, -1
    while True:
        try:
            return action()
        except TruncatedError as error:
            now, offset = time.monotonic(), error.offset or 0
            if offset > furthest_offset:
                deadline, furthest_offset = now + follow.patience, offset
            if now >= deadline:
                patience_text = str(follow.patience).removesuffix(".0")
                message = f"{error.args[0]}; no new data for {patience_text} s"
                raise TruncatedError(message, error.offset) from error
            time.sleep(follow.interval)
