"""SPEC 8.1, 8.4 and the rows of 8.5 in plain Python integers, written from SPEC alone.

It records a run for each context of each plane: the annexes print these runs, and the package must
find the same numbers.
"""

from dataclasses import dataclass, field
from typing import Any

from plain.coder import Counts, PlainCoder, add_to_counts, weight_by_counts, weight_of

Row = list[int]


@dataclass
class Run:
    """The bits of one context of a plane; of a raw plane, which has no model, all its bits."""

    section: str
    model: str | None
    plane: str
    context: int | None
    code: int | None
    weight: int
    bits: str


@dataclass
class PlainSection:
    """A section whose planes are read one by one.

    Attributes:
        title: Of the section.
        words: All of them.
        counts: Counts of the models, which are updated as planes are read.
    """

    title: str
    words: list[int]
    counts: Counts
    runs: list[Run] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.coder = PlainCoder(self.words)

    def plane(self, model: str, name: str, contexts: Row) -> Row:
        """The bits of a plane, in the order of its elements."""
        used = sorted(set(contexts))
        stated = [context for context in used if self.coder.bit(1 << 18)]
        codes = {context: self._code() for context in stated}
        bits = [0] * len(contexts)
        for context in used:
            code = codes.get(context)
            counts = self.counts.get((model, context), [0, 0])
            weight = weight_by_counts(*counts) if code is None else weight_of(code)
            there = [index for index, each in enumerate(contexts) if each == context]
            taken = [self.coder.bit(weight) for _ in there]
            for index, bit in zip(there, taken, strict=True):
                bits[index] = bit
            self.counts[model, context] = add_to_counts(counts, taken)
            self._note(model, name, context, code, weight, taken)
        return bits

    def raw(self, name: str, count: int) -> Row:
        bits = [self.coder.bit(1 << 23) for _ in range(count)]
        self._note(None, name, None, None, 1 << 23, bits)
        return bits

    def close(self) -> None:
        assert self.coder.state == 0, "unconsumed-words"
        assert not self.coder.words, "unconsumed-words"

    def _code(self) -> int:
        code = 0
        for _ in range(8):
            code = 2 * code + self.coder.bit(1 << 23)
        return code

    def _note(
        self,
        model: str | None,
        name: str,
        context: int | None,
        code: int | None,
        weight: int,
        bits: Row,
    ) -> None:
        taken = "".join(map(str, bits))
        self.runs.append(Run(self.title, model, name, context, code, weight, taken))


def open_section(title: str, stored: dict[str, Any], counts: Counts) -> PlainSection:
    """A section with parsed fields."""
    return PlainSection(title, list(stored["words"]), counts)


def fixed(section: PlainSection, name: str, contexts: Row, width: int) -> Row:
    nodes = [1] * len(contexts)
    for place in reversed(range(width)):
        asked = [(c << width) + node for c, node in zip(contexts, nodes, strict=True)]
        bits = section.plane(f"{name}, class", f"bit {place}", asked)
        nodes = [2 * node + bit for node, bit in zip(nodes, bits, strict=True)]
    return [node - (1 << width) for node in nodes]


def _mantissas(section: PlainSection, name: str, inner: Row, classes: Row) -> Row:
    """The numbers; `inner` is the part of the context before `known`."""
    known = [min(k, 1) for k in classes]
    for depth in range(max(classes, default=0)):
        there = [index for index, k in enumerate(classes) if k > depth + 1]
        if not there:
            break
        if depth < 2:
            asked = [4 * inner[i] + known[i] for i in there]
            bits = section.plane(f"{name}, mantissa", f"d = {depth}", asked)
        else:
            bits = section.raw(f"{name}, d = {depth}", len(there))
        for index, bit in zip(there, bits, strict=True):
            known[index] = 2 * known[index] + bit
    return known


def unsigned(section: PlainSection, name: str, contexts: Row, width: int) -> Row:
    classes = fixed(section, name, contexts, width)
    inner = [(c << width) + k for c, k in zip(contexts, classes, strict=True)]
    return _mantissas(section, name, inner, classes)


def signed(section: PlainSection, name: str, contexts: Row, width: int) -> Row:
    classes = fixed(section, name, contexts, width)
    inner = [(c << width) + k for c, k in zip(contexts, classes, strict=True)]
    there = [index for index, k in enumerate(classes) if k]
    signs = [0] * len(classes)
    answers = section.plane(f"{name}, sign", "", [inner[i] for i in there])
    for index, bit in zip(there, answers, strict=True):
        signs[index] = bit
    inner = [2 * c + sign for c, sign in zip(inner, signs, strict=True)]
    magnitudes = _mantissas(section, name, inner, classes)
    return [-m if sign else m for m, sign in zip(magnitudes, signs, strict=True)]


def ascending(section: PlainSection, name: str, count: int, width: int) -> Row:
    numbers, last = [], 0
    for step in unsigned(section, name, [0] * count, width):
        assert step <= 1 << 60, "symbol-range"
        last += step
        numbers.append(last)
    return numbers


def rows_in_contexts(section: PlainSection, name: str, count: int, height: int) -> list[Row]:
    """Rows of signed numbers, with a context for each row (SPEC 8.5)."""
    return _rows(section, name, count, [row for row in range(height) for _ in range(count)])


def rows_in_one_context(section: PlainSection, name: str, count: int, height: int) -> list[Row]:
    return _rows(section, name, count, [0] * (height * count))


def _rows(section: PlainSection, name: str, count: int, contexts: Row) -> list[Row]:
    flat = signed(section, name, contexts, 4)
    return [flat[start : start + count] for start in range(0, len(flat), count or 1)]
