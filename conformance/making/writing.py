"""Converts values to planes of bits, and bits to words: the encoder of SPEC 8.

The decoder in `plain` reads the planes of a section one after the other. A `WritingSection` takes
the place of the section that is read: it returns the bits of each plane, which are known in
advance, and encodes them with the contexts and counts of the decoder.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

from plain.coder import add_to_counts, weight_from_code, weight_from_counts
from plain.planes import PlainSection

WEIGHT_TOTAL = 1 << 24
Bits = list[int]
CodeChoice = Callable[[str, int, int, int], int | None]
"""Function of (model, context, zeros, ones) that chooses the probability code to write.

It returns None if no code is written for the context.
"""


def encode(weighted_bits: Iterable[tuple[int, int]]) -> list[int]:
    """Return the words that code pairs of (bit, weight of a 1) (SPEC 8.3)."""
    state, words = 0, []
    for bit, weight in reversed(list(weighted_bits)):
        offset, share = (WEIGHT_TOTAL - weight, weight) if bit else (0, WEIGHT_TOTAL - weight)
        if state >> 40 >= share:
            words.append(state % (1 << 32))
            state >>= 32
        state = state // share * WEIGHT_TOTAL + offset + state % share
    while state:
        words.append(state % (1 << 32))
        state >>= 32
    return words


@dataclass
class Planes:
    """The bits of every plane of a section, and the function that chooses its probability codes.

    Attributes:
        bits: Bits of each plane, in the order of the planes.
        choose_code: Function that chooses the probability code to write for a context, if any.
    """

    bits: list[Bits]
    choose_code: CodeChoice = field(default=lambda *_: None)


class WritingSection(PlainSection):
    """A section whose bits are known in advance; reading it encodes them into words."""

    def __init__(
        self, title: str, planes: Planes, counts: dict[tuple[str, int], list[int]]
    ) -> None:
        super().__init__(title, [], counts)
        self._planes = iter(planes.bits)
        self._choose_code = planes.choose_code
        self._weighted_bits: list[tuple[int, int]] = []
        self.written_words: list[int] = []

    def read_plane(self, model: str, name: str, contexts: list[int]) -> Bits:
        """See `PlainSection.read_plane`."""
        bits = next(self._planes)
        assert len(bits) == len(contexts), f"{model}, {name}: {len(bits)} of {len(contexts)} bits"
        bits_by_context: dict[int, Bits] = {context: [] for context in sorted(set(contexts))}
        for context, bit in zip(contexts, bits, strict=True):
            bits_by_context[context].append(bit)
        codes = {
            c: self._choose_code(model, c, len(b) - sum(b), sum(b))
            for c, b in bits_by_context.items()
        }
        self._weighted_bits += [(int(code is not None), 1 << 18) for code in codes.values()]
        for code in codes.values():
            if code is not None:
                self._weighted_bits += [
                    (code >> place & 1, WEIGHT_TOTAL // 2) for place in reversed(range(8))
                ]
        for context, context_bits in bits_by_context.items():
            code, counts = codes[context], self.counts.get((model, context), [0, 0])
            weight = weight_from_counts(*counts) if code is None else weight_from_code(code)
            self._weighted_bits += [(bit, weight) for bit in context_bits]
            self.counts[model, context] = add_to_counts(counts, context_bits)
        return bits

    def read_raw_plane(self, name: str, count: int) -> Bits:
        """See `PlainSection.read_raw_plane`."""
        bits = next(self._planes)
        assert len(bits) == count, name
        self._weighted_bits += [(bit, WEIGHT_TOTAL // 2) for bit in bits]
        return bits

    def close(self) -> None:
        """Encode the collected bits into `written_words`."""
        assert next(self._planes, None) is None, "planes remain"
        self.written_words = encode(self._weighted_bits)


def make_fixed_planes(values: Sequence[int], width: int) -> list[Bits]:
    """Return the planes that code `values` by Fixed (SPEC 8.4)."""
    return [[v >> place & 1 for v in values] for place in reversed(range(width))]


def make_unsigned_planes(values: Sequence[int], width: int) -> list[Bits]:
    """Return the planes that code `values` by Unsigned (SPEC 8.4)."""
    return make_fixed_planes([v.bit_length() for v in values], width) + _make_mantissa_planes(
        values
    )


def make_signed_planes(values: Sequence[int], width: int = 4) -> list[Bits]:
    """Return the planes that code `values` by Signed (SPEC 8.4)."""
    magnitudes = [abs(v) for v in values]
    signs = [int(v < 0) for v in values if v]
    return [
        *make_fixed_planes([v.bit_length() for v in magnitudes], width),
        signs,
        *_make_mantissa_planes(magnitudes),
    ]


def make_ascending_planes(values: Sequence[int], width: int = 6) -> list[Bits]:
    """Return the planes that code `values` by Ascending (SPEC 8.4)."""
    differences = [v - previous for v, previous in zip(values, [0, *values], strict=False)]
    return make_unsigned_planes(differences, width)


def make_row_planes(*rows: Sequence[int]) -> list[Bits]:
    """Return the planes that code rows of signed numbers (SPEC 8.5)."""
    return make_signed_planes([v for row in rows for v in row])


def _make_mantissa_planes(values: Sequence[int]) -> list[Bits]:
    max_bits = max((v.bit_length() for v in values), default=0)
    return [
        [v >> (v.bit_length() - 2 - depth) & 1 for v in values if v.bit_length() > depth + 1]
        for depth in range(max_bits - 1)
    ]
