"""SPEC 8.1 to 8.4 in plain Python integers, written from the text alone.

What it decodes it notes down, a row to each context of each plane: the annexes
print these rows, and the package must come to the same numbers.
"""

from dataclasses import dataclass, field
from typing import Any


def weight_of(code: int) -> int:
    """The weight of a 1 (SPEC 8.2)."""
    assert code < 240, "bad-probability"
    if code >= 120:
        return (1 << 24) - weight_of(code - 120)
    return (8 + code % 8) << (code // 8 + 5)


@dataclass
class Run:
    """The bits of one context of a plane."""

    section: str
    plane: str
    context: int | None
    code: int | None
    bits: str


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
        part = self.state % (1 << 24)
        bit = int(part >= (1 << 24) - weight)
        left, share = ((1 << 24) - weight, weight) if bit else (0, (1 << 24) - weight)
        self.state = (self.state >> 24) * share + part - left
        assert self.state < 1 << 64
        return bit


@dataclass
class PlainSection:
    """A section whose planes are asked for one by one."""

    title: str
    table: list[int]
    words: list[int]
    runs: list[Run] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.coder = PlainCoder(self.words)

    def plane(self, name: str, contexts: list[int]) -> list[int]:
        bits = [0] * len(contexts)
        for context in sorted(set(contexts)):
            code = self.table.pop(0)
            there = [index for index, each in enumerate(contexts) if each == context]
            for index in there:
                bits[index] = self.coder.bit(weight_of(code))
            taken = "".join(str(bits[index]) for index in there)
            self.runs.append(Run(self.title, name, context, code, taken))
        return bits

    def raw(self, name: str, count: int) -> list[int]:
        bits = [self.coder.bit(1 << 23) for _ in range(count)]
        self.runs.append(Run(self.title, name, None, None, "".join(map(str, bits))))
        return bits

    def close(self) -> None:
        assert not self.table, "table-length"
        assert self.coder.state == 0, "unconsumed-words"
        assert not self.coder.words, "unconsumed-words"


def open_section(title: str, stored: dict[str, Any]) -> PlainSection:
    """A section of parsed fields."""
    return PlainSection(title, list(stored["table"]), list(stored["words"]))


def fixed(section: PlainSection, name: str, contexts: list[int], width: int) -> list[int]:
    nodes = [1] * len(contexts)
    for place in reversed(range(width)):
        asked = [(c << width) + node for c, node in zip(contexts, nodes, strict=True)]
        bits = section.plane(f"{name}: bit {place}", asked)
        nodes = [2 * node + bit for node, bit in zip(nodes, bits, strict=True)]
    return [node - (1 << width) for node in nodes]


def _mantissas(
    section: PlainSection, name: str, contexts: list[int], classes: list[int]
) -> list[int]:
    known = [min(k, 1) for k in classes]
    for depth in range(max(classes, default=0)):
        there = [index for index, k in enumerate(classes) if k > depth + 1]
        if not there:
            break
        title = f"{name}: mantissa {depth}"
        if depth < 4:
            bits = section.plane(title, [(contexts[i] << 4) + known[i] for i in there])
        else:
            bits = section.raw(title, len(there))
        for index, bit in zip(there, bits, strict=True):
            known[index] = 2 * known[index] + bit
    return known


def unsigned(section: PlainSection, name: str, contexts: list[int], width: int) -> list[int]:
    classes = fixed(section, f"{name}: class", contexts, width)
    inner = [(c << width) + k for c, k in zip(contexts, classes, strict=True)]
    return _mantissas(section, name, inner, classes)


def signed(section: PlainSection, name: str, contexts: list[int], width: int) -> list[int]:
    classes = fixed(section, f"{name}: class", contexts, width)
    inner = [(c << width) + k for c, k in zip(contexts, classes, strict=True)]
    there = [index for index, k in enumerate(classes) if k]
    signs = [0] * len(classes)
    answers = section.plane(f"{name}: sign", [inner[i] for i in there])
    for index, bit in zip(there, answers, strict=True):
        signs[index] = bit
    contexts = [2 * c + sign for c, sign in zip(inner, signs, strict=True)]
    magnitudes = _mantissas(section, name, contexts, classes)
    return [-m if sign else m for m, sign in zip(magnitudes, signs, strict=True)]


def ascending(section: PlainSection, name: str, count: int, width: int) -> list[int]:
    numbers, last = [], 0
    for step in unsigned(section, name, [0] * count, width):
        assert step <= 1 << 60, "symbol-range"
        last += step
        numbers.append(last)
    return numbers


def rows(
    section: PlainSection, name: str, count: int, height: int, *, apart: bool
) -> list[list[int]]:
    """Rows of signed numbers; apart: a context to each row."""
    contexts = [row if apart else 0 for row in range(height) for _ in range(count)]
    flat = signed(section, name, contexts, 4)
    return [flat[row * count : (row + 1) * count] for row in range(height)]
