"""The motion section, SPEC 8.7, in plain Python integers."""

from tests.spec.plain_planes import PlainSection
from tests.spec.plain_state import PlainLevel, Vector


def read_motion(
    section: PlainSection, channels: int, motion: dict[int, Vector], levels: list[PlainLevel]
) -> None:
    """Set the symbols of every anchor.

    Args:
        section: Of the frame.
        channels: 6 or 7.
        motion: Of the frame before, by id; what is not there is 0.
        levels: Level 1 first.
    """
    zeros = [0] * channels
    empty = not section.table and not section.words and not section.coder.state
    above: list[Vector] = []
    for number in reversed(range(len(levels))):
        level = levels[number]
        level.symbols = [list(zeros) for _ in level.owners]
        if not empty:
            parents = [above[p] for p in level.parents] if above else [zeros] * len(level.owners)
            previous = [motion.get(owner, zeros) for owner in level.owners]
            _read_level(section, f"level {number + 1}", (parents, previous), level.symbols)
        above = level.symbols


def _read_level(
    section: PlainSection,
    name: str,
    known: tuple[list[Vector], list[Vector]],
    symbols: list[Vector],
) -> None:
    parents, previous = known
    contexts = [
        5 * _bucket(p, (1, 2, 4)) + _bucket(v, (1, 2, 4, 8))
        for p, v in zip(parents, previous, strict=True)
    ]
    moving = [i for i, bit in enumerate(section.plane(f"{name}: moves", contexts)) if bit]
    channels = len(symbols[0])
    groups = {
        "translation": range(3),
        "w": range(3, channels - 3),
        "rotation": range(channels - 3, channels),
    }
    for group, rows in groups.items():
        asked = [(c, i) for c in rows for i in moving]
        values = _read_group(
            section,
            f"{name} {group}",
            [parents[i][c] for c, i in asked],
            [previous[i][c] for c, i in asked],
        )
        for (c, i), value in zip(asked, values, strict=True):
            symbols[i][c] = value


def _bucket(symbols: Vector, borders: tuple[int, ...]) -> int:
    return sum(sum(map(abs, symbols)) >= border for border in borders)


def _read_group(section: PlainSection, name: str, parents: Vector, previous: Vector) -> Vector:
    contexts = [
        3 * min(abs(p), 2) + min((abs(v) + 1) // 2, 2)
        for p, v in zip(parents, previous, strict=True)
    ]
    values = section.plane(f"{name}: not 0", contexts)
    there = [i for i, bit in enumerate(values) if bit]
    signs = [(parents[i] > 0) - (parents[i] < 0) + 1 for i in there]
    answers = section.plane(f"{name}: negative", signs)
    negative = [i for i, bit in zip(there, answers, strict=True) if bit]
    left = there
    for plane in range(64):
        near = [min(abs(parents[i]), 3) if plane < 2 else 0 for i in left]
        bits = section.plane(f"{name}: above {plane + 1}", near)
        left = [i for i, bit in zip(left, bits, strict=True) if bit]
        for i in left:
            values[i] += 1
    for i in negative:
        values[i] = -values[i]
    return values
