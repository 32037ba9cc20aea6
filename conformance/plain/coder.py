"""SPEC 8.2 and 8.3 in plain Python integers, written from SPEC alone."""

from dataclasses import dataclass

_TOTAL = 1 << 24
_COUNT_LIMIT = 4096

Counts = dict[tuple[str, int], list[int]]
"""Zeros and ones by model and context; missing ones are 0."""


def weight_of(code: int) -> int:
    """The weight of a 1 for a stated code."""
    assert code < 240, "bad-probability"
    if code >= 120:
        return _TOTAL - weight_of(code - 120)
    return (8 + code % 8) << (code // 8 + 5)


def weight_by_counts(zeros: int, ones: int) -> int:
    """The weight of a 1 without a stated code."""
    return (2 * ones + 1) * _TOTAL // (2 * (zeros + ones) + 2)


def add_to_counts(counts: list[int], bits: list[int]) -> list[int]:
    """The counts of a context after a plane."""
    ones = counts[1] + sum(bits)
    zeros = counts[0] + len(bits) - sum(bits)
    while zeros + ones > _COUNT_LIMIT:
        zeros, ones = zeros // 2, ones // 2
    return [zeros, ones]


@dataclass
class PlainCoder:
    """The decoder of SPEC 8.3."""

    words: list[int]
    state: int = 0

    def __post_init__(self) -> None:
        if self.words:
            self.state = self.words.pop()
            assert self.state, "invalid-words"

    def bit(self, weight: int) -> int:
        if self.state < 1 << 32 and self.words:
            self.state = (self.state << 32) + self.words.pop()
        part = self.state % _TOTAL
        bit = int(part >= _TOTAL - weight)
        left, share = (_TOTAL - weight, weight) if bit else (0, _TOTAL - weight)
        self.state = self.state // _TOTAL * share + part - left
        assert self.state < 1 << 64
        return bit
