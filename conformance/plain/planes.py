"""Reads planes and integers (SPEC 8.1, 8.4, 8.5) in plain integers; written from SPEC.md alone.

A section records a run for each context of each plane. The annexes of SPEC.md print these runs.
"""

from dataclasses import dataclass, field
from typing import Any

from plain.coder import Counts, PlainBitDecoder, add_to_counts, weight_from_code, weight_from_counts

Row = list[int]


@dataclass
class Run:
    """The bits that a plane codes in one context; for a raw plane, all its bits."""

    section: str
    model: str | None
    plane: str
    context: int | None
    code: int | None
    weight: int
    bits: str


@dataclass
class PlainSection:
    """A section, whose planes are read one after the other.

    Attributes:
        title: Name of the section, such as `motion`.
        words: The 32-bit words of the section.
        counts: Numbers of zeros and ones of each context; reading a plane updates them.
    """

    title: str
    words: list[int]
    counts: Counts
    runs: list[Run] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.coder = PlainBitDecoder(self.words)

    def read_plane(self, model: str, name: str, contexts: Row) -> Row:
        """Return the bits of a plane, in the order of its elements."""
        distinct_contexts = sorted(set(contexts))
        stated_contexts = [
            context for context in distinct_contexts if self.coder.decode_bit(1 << 18)
        ]
        codes = {context: self._read_code() for context in stated_contexts}
        bits = [0] * len(contexts)
        for context in distinct_contexts:
            code = codes.get(context)
            counts = self.counts.get((model, context), [0, 0])
            weight = weight_from_counts(*counts) if code is None else weight_from_code(code)
            indices = [
                index for index, plane_context in enumerate(contexts) if plane_context == context
            ]
            context_bits = [self.coder.decode_bit(weight) for _ in indices]
            for index, bit in zip(indices, context_bits, strict=True):
                bits[index] = bit
            self.counts[model, context] = add_to_counts(counts, context_bits)
            self._record_run(model, name, context, code, weight, context_bits)
        return bits

    def read_raw_plane(self, name: str, count: int) -> Row:
        bits = [self.coder.decode_bit(1 << 23) for _ in range(count)]
        self._record_run(None, name, None, None, 1 << 23, bits)
        return bits

    def close(self) -> None:
        assert self.coder.state == 0, "unconsumed-words"
        assert not self.coder.words, "unconsumed-words"

    def _read_code(self) -> int:
        code = 0
        for _ in range(8):
            code = 2 * code + self.coder.decode_bit(1 << 23)
        return code

    def _record_run(
        self,
        model: str | None,
        name: str,
        context: int | None,
        code: int | None,
        weight: int,
        bits: Row,
    ) -> None:
        bit_text = "".join(map(str, bits))
        self.runs.append(Run(self.title, model, name, context, code, weight, bit_text))


def open_section(title: str, stored: dict[str, Any], counts: Counts) -> PlainSection:
    """Return a section to read, given its parsed fields."""
    return PlainSection(title, list(stored["words"]), counts)


def read_fixed(section: PlainSection, name: str, contexts: Row, width: int) -> Row:
    nodes = [1] * len(contexts)
    for bit_number in reversed(range(width)):
        node_contexts = [(c << width) + node for c, node in zip(contexts, nodes, strict=True)]
        bits = section.read_plane(f"{name}, class", f"bit {bit_number}", node_contexts)
        nodes = [2 * node + bit for node, bit in zip(nodes, bits, strict=True)]
    return [node - (1 << width) for node in nodes]


def _read_mantissas(section: PlainSection, name: str, inner_contexts: Row, classes: Row) -> Row:
    """Return the magnitudes; a context combines `inner_contexts` with the bits read so far."""
    values = [min(k, 1) for k in classes]
    for depth in range(max(classes, default=0)):
        indices = [index for index, k in enumerate(classes) if k > depth + 1]
        if not indices:
            break
        if depth < 2:
            mantissa_contexts = [4 * inner_contexts[i] + values[i] for i in indices]
            bits = section.read_plane(f"{name}, mantissa", f"d = {depth}", mantissa_contexts)
        else:
            bits = section.read_raw_plane(f"{name}, d = {depth}", len(indices))
        for index, bit in zip(indices, bits, strict=True):
            values[index] = 2 * values[index] + bit
    return values


def read_unsigned(section: PlainSection, name: str, contexts: Row, width: int) -> Row:
    classes = read_fixed(section, name, contexts, width)
    inner_contexts = [(c << width) + k for c, k in zip(contexts, classes, strict=True)]
    return _read_mantissas(section, name, inner_contexts, classes)


def read_signed(section: PlainSection, name: str, contexts: Row, width: int) -> Row:
    classes = read_fixed(section, name, contexts, width)
    inner_contexts = [(c << width) + k for c, k in zip(contexts, classes, strict=True)]
    indices = [index for index, k in enumerate(classes) if k]
    signs = [0] * len(classes)
    sign_bits = section.read_plane(f"{name}, sign", "", [inner_contexts[i] for i in indices])
    for index, bit in zip(indices, sign_bits, strict=True):
        signs[index] = bit
    inner_contexts = [2 * c + sign for c, sign in zip(inner_contexts, signs, strict=True)]
    magnitudes = _read_mantissas(section, name, inner_contexts, classes)
    return [-m if sign else m for m, sign in zip(magnitudes, signs, strict=True)]


def read_ascending(section: PlainSection, name: str, count: int, width: int) -> Row:
    numbers, number = [], 0
    for step in read_unsigned(section, name, [0] * count, width):
        assert step <= 1 << 60, "symbol-range"
        number += step
        numbers.append(number)
    return numbers


def read_rows_by_context(section: PlainSection, name: str, count: int, row_count: int) -> list[Row]:
    """Return rows of signed numbers; each row has its own context (SPEC 8.5)."""
    return _read_rows(section, name, count, [row for row in range(row_count) for _ in range(count)])


def read_rows_in_one_context(
    section: PlainSection, name: str, count: int, row_count: int
) -> list[Row]:
    return _read_rows(section, name, count, [0] * (row_count * count))


def _read_rows(section: PlainSection, name: str, count: int, contexts: Row) -> list[Row]:
    values = read_signed(section, name, contexts, 4)
    return [values[start : start + count] for start in range(0, len(values), count or 1)]
