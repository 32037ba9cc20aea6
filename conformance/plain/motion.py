"""Reads the motion section (SPEC 8.7) in plain integers; written from SPEC.md alone."""

from plain.planes import PlainSection
from plain.state import PlainLevel, Vector

# The lowest f - i of each context class k = 1, 2, ..., 10 of the magnitude planes.
_MAGNITUDE_BORDERS = (-8, -3, -1, 0, 1, 2, 3, 4, 6, 10)


def read_motion(
    section: PlainSection,
    channel_count: int,
    previous_motion: dict[int, Vector],
    levels: list[PlainLevel],
) -> None:
    """Set the expected and the coded symbols of the anchors of every level.

    Args:
        section: Motion section of the frame.
        channel_count: Number of symbols of an anchor: 6, or 7 if rotations have w.
        previous_motion: Motion in the previous frame, by id of the Gaussian; 0 if an id is missing.
        levels: Anchor levels, beginning with level 1.
    """
    zeros = [0] * channel_count
    # The anchors of level L have no parents, and are coded as if they had parents that do not move.
    symbols, parent_sums = [zeros], [zeros]
    for level_number in range(len(levels), 0, -1):
        level = levels[level_number - 1]
        parents = level.parents if level_number < len(levels) else [0] * len(level.owners)
        parent_symbols = [symbols[p] for p in parents]
        parent_sums = [_add(symbols[p], parent_sums[p]) for p in parents]
        motion_of_anchors = [previous_motion.get(owner, zeros) for owner in level.owners]
        level.expected = [
            _subtract(o, d) for o, d in zip(motion_of_anchors, parent_sums, strict=True)
        ]
        level.symbols = _LevelReader(section, f"motion {level_number}", level.expected).read(
            parent_symbols
        )
        symbols = level.symbols


# (channel, anchor) of a symbol.
SymbolIndex = tuple[int, int]


def _add(first: Vector, second: Vector) -> Vector:
    return [a + b for a, b in zip(first, second, strict=True)]


def _subtract(first: Vector, second: Vector) -> Vector:
    return [a - b for a, b in zip(first, second, strict=True)]


def _classify(value: int, borders: tuple[int, ...]) -> int:
    """Return the number of borders that are less than or equal to `value`."""
    return sum(value >= border for border in borders)


class _LevelReader:
    def __init__(self, section: PlainSection, name: str, expected: list[Vector]) -> None:
        self.section, self.name, self.expected = section, name, expected
        self.symbols = [[0] * len(vector) for vector in expected]

    def read(self, parent_symbols: list[Vector]) -> list[Vector]:
        contexts = [
            5 * _classify(sum(map(abs, parent)), (1, 2, 4))
            + _classify(sum(map(abs, expected)), (1, 2, 4, 8))
            for parent, expected in zip(parent_symbols, self.expected, strict=True)
        ]
        bits = self.section.read_plane(f"{self.name}, moves", "", contexts)
        moving_anchors = [anchor for anchor, bit in enumerate(bits) if bit]
        nonzero = self._read_nonzero(moving_anchors)
        negative = self._read_signs(nonzero)
        magnitudes = self._read_magnitudes(nonzero, negative)
        for (channel, anchor), magnitude in magnitudes.items():
            sign = -1 if (channel, anchor) in negative else 1
            self.symbols[anchor][channel] = sign * magnitude
        return self.symbols

    def _read_nonzero(self, moving_anchors: list[int]) -> list[SymbolIndex]:
        """Return (channel, anchor) of each nonzero symbol, in the order of the planes."""
        nonzero: list[SymbolIndex] = []
        channel_count = len(self.symbols[0])
        for channel in range(channel_count):
            kind = "translation" if channel < 3 else "rotation"
            kind = "w" if channel == 3 and channel_count == 7 else kind
            earlier_counts = {
                a: sum(1 for _, nonzero_anchor in nonzero if nonzero_anchor == a)
                for a in moving_anchors
            }
            contexts = [
                4 * min(abs(self.expected[a][channel]), 3) + min(earlier_counts[a], 3)
                for a in moving_anchors
            ]
            bits = self.section.read_plane(
                f"{self.name}, {kind} not 0", f"channel {channel}", contexts
            )
            nonzero += [(channel, a) for a, bit in zip(moving_anchors, bits, strict=True) if bit]
        return nonzero

    def _read_signs(self, nonzero: list[SymbolIndex]) -> set[SymbolIndex]:
        contexts = []
        for channel, anchor in nonzero:
            expected = self.expected[anchor][channel]
            k = _classify(abs(expected), (1, 2, 4, 8))
            contexts.append(4 + k if expected >= 0 else 4 - k)
        bits = self.section.read_plane(f"{self.name}, sign", "", contexts)
        return {index for index, bit in zip(nonzero, bits, strict=True) if bit}

    def _read_magnitudes(
        self, nonzero: list[SymbolIndex], negative: set[SymbolIndex]
    ) -> dict[SymbolIndex, int]:
        magnitudes = dict.fromkeys(nonzero, 1)
        larger = nonzero
        for i in range(64):
            contexts = []
            for channel, anchor in larger:
                expected = self.expected[anchor][channel]
                f = -expected if (channel, anchor) in negative else expected
                contexts.append(11 * min(i, 2) + _classify(f - i, _MAGNITUDE_BORDERS))
            bits = self.section.read_plane(f"{self.name}, magnitude", f"i = {i}", contexts)
            larger = [index for index, bit in zip(larger, bits, strict=True) if bit]
            for index in larger:
                magnitudes[index] += 1
        return magnitudes
