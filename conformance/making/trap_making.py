"""What traps are made of."""

from collections.abc import Callable

from making.scenes import between
from making.streams import Stream
from making.vectors import Valid, valid


def trap(name: str, clauses: str, stream: Stream, note: str) -> Valid:
    """Return a trap of a stream that lacks TAIL alone."""
    return valid(f"traps/{name}", note, f"1-2 {clauses}", stream.end())


def telling(channels: int) -> Callable[[int, int], list[int]]:
    """Symbols that tell every anchor from every other."""

    def symbols(level: int, anchor: int) -> list[int]:
        turn = [between(-2, 2, level, anchor, c) for c in range(channels - 3)]
        return [anchor % 9 - 4, anchor // 9 - 2, level, *turn]

    return symbols
