"""Turns trap functions into vectors, and makes the motion that several traps share."""

from collections.abc import Callable, Iterable
from typing import Any

from making.changes import Change
from making.scenes import pick_between
from making.streams import Stream
from making.vectors import ValidStream, make_valid_stream

Trap = tuple[str, Callable[[], Stream], str]
"""Name of the vector, function that returns the stream without TAIL, and tested clauses.

The docstring of the function is the description of the vector.
"""


def make_trap_streams(traps: Iterable[Trap], **options: Any) -> list[ValidStream]:
    """Return a valid stream for each trap."""
    return [_make_trap(*trap, options) for trap in traps]


def _make_trap(
    name: str, make_stream: Callable[[], Stream], clauses: str, options: dict[str, Any]
) -> ValidStream:
    note = (make_stream.__doc__ or "").removesuffix(".")
    return make_valid_stream(
        f"traps/{name}",
        note[:1].lower() + note[1:],
        f"1-2 {clauses}",
        make_stream().finish(),
        **options,
    )


def make_distinct_motion(channels: int = 6) -> Change:
    """Return a change in which every anchor moves differently."""
    return Change(make_distinct_symbols(channels))


def make_distinct_symbols(channels: int = 6) -> Callable[[int, int], list[int]]:
    """Return symbols that are different for every anchor."""

    def symbols(level: int, anchor: int) -> list[int]:
        rotation = [pick_between(-2, 2, level, anchor, c) for c in range(channels - 3)]
        return [anchor % 9 - 4, anchor // 9 - 2, level, *rotation]

    return symbols
