"""Decodes bits by their probabilities (SPEC 8.2, 8.3); written from SPEC.md alone."""

from dataclasses import dataclass

_WEIGHT_TOTAL = 1 << 24
_COUNT_LIMIT = 4096

Counts = dict[tuple[str, int], list[int]]
"""Counts [zeros, ones] by (model, context); a missing entry means [0, 0]."""


def weight_from_code(code: int) -> int:
    """Return the weight of a 1 for a stated probability code."""
    assert code < 240, "bad-probability"
    if code >= 120:
        return _WEIGHT_TOTAL - weight_from_code(code - 120)
    return (8 + code % 8) << (code // 8 + 5)


def weight_from_counts(zeros: int, ones: int) -> int:
    """Return the weight of a 1 for a context that has counted these zeros and ones."""
    return (2 * ones + 1) * _WEIGHT_TOTAL // (2 * (zeros + ones) + 2)


def add_to_counts(counts: list[int], bits: list[int]) -> list[int]:
    """Return the counts (zeros, ones) of a context after it has coded the bits of a plane."""
    ones = counts[1] + sum(bits)
    zeros = counts[0] + len(bits) - sum(bits)
    while zeros + ones > _COUNT_LIMIT:
        zeros, ones = zeros // 2, ones // 2
    return [zeros, ones]


@dataclass
class PlainBitDecoder:
    """The entropy decoder of SPEC 8.3: decodes bits from the words of a section."""

    words: list[int]
    state: int = 0

    def __post_init__(self) -> None:
        if self.words:
            self.state = self.words.pop()
            assert self.state, "invalid-words"

    def decode_bit(self, weight: int) -> int:
        if self.state < 1 << 32 and self.words:
            self.state = (self.state << 32) + self.words.pop()
        remainder = self.state % _WEIGHT_TOTAL
        bit = int(remainder >= _WEIGHT_TOTAL - weight)
        offset, share = (_WEIGHT_TOTAL - weight, weight) if bit else (0, _WEIGHT_TOTAL - weight)
        self.state = self.state // _WEIGHT_TOTAL * share + remainder - offset
        assert self.state < 1 << 64
        return bit
