"""Values to bits, and bits to words: the writing direction of SPEC 8.

The walks of `plain` request the planes of a section. A writing section knows the bits of every
plane in advance, in the order of the planes; contexts and counts come from the walk, so reading and
writing agree.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

from plain.coder import add_to_counts, weight_from_code, weight_from_counts
from plain.planes import PlainSection

TOTAL = 1 << 24
Bits = list[int]
State = Callable[[str, int, int, int], int | None]
"""Returns the code to state, if any, for model, context, zeros and ones of a plane."""


def encode(bits: Iterable[tuple[int, int]]) -> list[int]:
    """Return the words of (bit, weight of a 1), first to last (SPEC 8.3)."""
    state, words = 0, []
    for bit, weight in reversed(list(bits)):
        left, share = (TOTAL - weight, weight) if bit else (0, TOTAL - weight)
        if state >> 40 >= share:
            words.append(state % (1 << 32))
            state >>= 32
        state = state // share * TOTAL + left + state % share
    while state:
        words.append(state % (1 << 32))
        state >>= 32
    return words


@dataclass
class Planes:
    """The bits of every plane of a section, and the stated codes.

    Attributes:
        bits: Bits of each plane, in the order of the planes.
        stating: Which codes are stated.
    """

    bits: list[Bits]
    stating: State = field(default=lambda *_: None)


class WritingSection(PlainSection):
    """A section that returns known bits, and collects them for the coder."""

    def __init__(
        self, title: str, planes: Planes, counts: dict[tuple[str, int], list[int]]
    ) -> None:
        super().__init__(title, [], counts)
        self._planes = iter(planes.bits)
        self._stating = planes.stating
        self._coded: list[tuple[int, int]] = []
        self.written: list[int] = []

    def read_plane(self, model: str, name: str, contexts: list[int]) -> Bits:
        """See `PlainSection.plane`."""
        bits = next(self._planes)
        assert len(bits) == len(contexts), f"{model}, {name}: {len(bits)} of {len(contexts)} bits"
        parts: dict[int, Bits] = {context: [] for context in sorted(set(contexts))}
        for context, bit in zip(contexts, bits, strict=True):
            parts[context].append(bit)
        codes = {c: self._stating(model, c, len(b) - sum(b), sum(b)) for c, b in parts.items()}
        self._coded += [(int(code is not None), 1 << 18) for code in codes.values()]
        for code in codes.values():
            if code is not None:
                self._coded += [(code >> place & 1, TOTAL // 2) for place in reversed(range(8))]
        for context, part in parts.items():
            code, counts = codes[context], self.counts.get((model, context), [0, 0])
            weight = weight_from_counts(*counts) if code is None else weight_from_code(code)
            self._coded += [(bit, weight) for bit in part]
            self.counts[model, context] = add_to_counts(counts, part)
        return bits

    def read_raw_plane(self, name: str, count: int) -> Bits:
        """See `PlainSection.raw`."""
        bits = next(self._planes)
        assert len(bits) == count, name
        self._coded += [(bit, TOTAL // 2) for bit in bits]
        return bits

    def close(self) -> None:
        """Make the words."""
        assert next(self._planes, None) is None, "planes are left"
        self.written = encode(self._coded)


def fixed(values: Sequence[int], width: int) -> list[Bits]:
    """Return the planes of Fixed (SPEC 8.4)."""
    return [[v >> place & 1 for v in values] for place in reversed(range(width))]


def unsigned(values: Sequence[int], width: int) -> list[Bits]:
    """Return the planes of Unsigned (SPEC 8.4)."""
    return fixed([v.bit_length() for v in values], width) + _mantissas(values)


def signed(values: Sequence[int], width: int = 4) -> list[Bits]:
    """Return the planes of Signed (SPEC 8.4)."""
    sizes = [abs(v) for v in values]
    signs = [int(v < 0) for v in values if v]
    return [*fixed([v.bit_length() for v in sizes], width), signs, *_mantissas(sizes)]


def ascending(values: Sequence[int], width: int = 6) -> list[Bits]:
    """Return the planes of Ascending (SPEC 8.4)."""
    steps = [v - before for v, before in zip(values, [0, *values], strict=False)]
    return unsigned(steps, width)


def rows(*values: Sequence[int]) -> list[Bits]:
    """Return the planes of rows of signed numbers (SPEC 8.5)."""
    return signed([v for row in values for v in row])


def _mantissas(values: Sequence[int]) -> list[Bits]:
    most = max((v.bit_length() for v in values), default=0)
    return [
        [v >> (v.bit_length() - 2 - depth) & 1 for v in values if v.bit_length() > depth + 1]
        for depth in range(most - 1)
    ]
