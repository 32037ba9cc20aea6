"""The motion section, SPEC 8.7, in plain Python integers, written from SPEC alone."""

from plain.planes import PlainSection
from plain.state import PlainLevel, Vector

# k of the magnitude planes: the least f - i of k = 1, 2, ..., 10
_NEARNESS = (-8, -3, -1, 0, 1, 2, 3, 4, 6, 10)


def read_motion(
    section: PlainSection, channels: int, motion: dict[int, Vector], levels: list[PlainLevel]
) -> None:
    """Set the symbols of every anchor.

    Args:
        section: Of the frame.
        channels: 6 or 7.
        motion: Symbols of the previous frame by id; missing ones are 0.
        levels: Level 1 first.
    """
    zeros = [0] * channels
    # Above level L all anchors count as having a parent without symbols.
    symbols, done = [zeros], [zeros]
    for number in range(len(levels), 0, -1):
        level = levels[number - 1]
        parents = level.parents if number < len(levels) else [0] * len(level.owners)
        above = [symbols[p] for p in parents]
        done = [_add(symbols[p], done[p]) for p in parents]
        own = [motion.get(owner, zeros) for owner in level.owners]
        level.expected = [_subtract(o, d) for o, d in zip(own, done, strict=True)]
        level.symbols = _LevelReader(section, f"motion {number}", level.expected).read(above)
        symbols = level.symbols


# Channel and anchor of a symbol.
Place = tuple[int, int]


def _add(first: Vector, second: Vector) -> Vector:
    return [a + b for a, b in zip(first, second, strict=True)]


def _subtract(first: Vector, second: Vector) -> Vector:
    return [a - b for a, b in zip(first, second, strict=True)]


def _class(value: int, borders: tuple[int, ...]) -> int:
    """The number of borders that a value has reached."""
    return sum(value >= border for border in borders)


class _LevelReader:
    def __init__(self, section: PlainSection, name: str, expected: list[Vector]) -> None:
        self.section, self.name, self.expected = section, name, expected
        self.symbols = [[0] * len(vector) for vector in expected]

    def read(self, above: list[Vector]) -> list[Vector]:
        contexts = [
            5 * _class(sum(map(abs, parent)), (1, 2, 4))
            + _class(sum(map(abs, expected)), (1, 2, 4, 8))
            for parent, expected in zip(above, self.expected, strict=True)
        ]
        bits = self.section.plane(f"{self.name}, moves", "", contexts)
        moving = [anchor for anchor, bit in enumerate(bits) if bit]
        there = self._read_where(moving)
        negative = self._read_signs(there)
        magnitudes = self._read_magnitudes(there, negative)
        for (channel, anchor), size in magnitudes.items():
            sign = -1 if (channel, anchor) in negative else 1
            self.symbols[anchor][channel] = sign * size
        return self.symbols

    def _read_where(self, moving: list[int]) -> list[Place]:
        """Channel and anchor of all nonzero symbols, in the order of the planes."""
        there: list[Place] = []
        channels = len(self.symbols[0])
        for channel in range(channels):
            kind = "translation" if channel < 3 else "rotation"
            kind = "w" if channel == 3 and channels == 7 else kind
            before = {a: sum(1 for _, other in there if other == a) for a in moving}
            contexts = [
                4 * min(abs(self.expected[a][channel]), 3) + min(before[a], 3) for a in moving
            ]
            bits = self.section.plane(f"{self.name}, {kind} not 0", f"channel {channel}", contexts)
            there += [(channel, a) for a, bit in zip(moving, bits, strict=True) if bit]
        return there

    def _read_signs(self, there: list[Place]) -> set[Place]:
        contexts = []
        for channel, anchor in there:
            expected = self.expected[anchor][channel]
            k = _class(abs(expected), (1, 2, 4, 8))
            contexts.append(4 + k if expected >= 0 else 4 - k)
        bits = self.section.plane(f"{self.name}, sign", "", contexts)
        return {place for place, bit in zip(there, bits, strict=True) if bit}

    def _read_magnitudes(self, there: list[Place], negative: set[Place]) -> dict[Place, int]:
        sizes = dict.fromkeys(there, 1)
        left = there
        for i in range(64):
            contexts = []
            for channel, anchor in left:
                expected = self.expected[anchor][channel]
                f = -expected if (channel, anchor) in negative else expected
                contexts.append(11 * min(i, 2) + _class(f - i, _NEARNESS))
            bits = self.section.plane(f"{self.name}, magnitude", f"i = {i}", contexts)
            left = [place for place, bit in zip(left, bits, strict=True) if bit]
            for place in left:
                sizes[place] += 1
        return sizes
