"""The common parts of traps."""

from collections.abc import Callable, Iterable
from typing import Any

from making.changes import Change
from making.scenes import between
from making.streams import Stream
from making.vectors import Valid, valid

Trap = tuple[Callable[[], Stream], str]
"""A function that makes the stream without TAIL, and the clauses.

The function has the name and the description of the trap.
"""


def make_trap_vectors(traps: Iterable[Trap], **more: Any) -> list[Valid]:
    """Return the streams of traps."""
    return [_make_trap(make, clauses, more) for make, clauses in traps]


def _make_trap(make: Callable[[], Stream], clauses: str, more: dict[str, Any]) -> Valid:
    note = (make.__doc__ or "").removesuffix(".")
    name = make.__name__.replace("_", "-")
    return valid(
        f"traps/{name}", note[:1].lower() + note[1:], f"1-2 {clauses}", make().end(), **more
    )


def distinct_motion(channels: int = 6) -> Change:
    """Return motion by symbols that are different for every anchor."""
    return Change(distinct_symbols(channels))


def distinct_symbols(channels: int = 6) -> Callable[[int, int], list[int]]:
    """Return symbols that are different for every anchor."""

    def symbols(level: int, anchor: int) -> list[int]:
        turn = [between(-2, 2, level, anchor, c) for c in range(channels - 3)]
        return [anchor % 9 - 4, anchor // 9 - 2, level, *turn]

    return symbols
