"""The tables of Annex F: inputs, and the answers of two independent implementations.

The package computes a table from its inputs. The check reads the cells of the text, and the
package and the independent implementation must reproduce the outputs.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from plain.coder import PlainBitDecoder, add_to_counts
from quarc_ref.decoder.philox import philox
from quarc_ref.decoder.rotation import _normalize, expand_rotations, normalize_sums, rotate
from quarc_ref.format import arithmetic
from quarc_ref.format.coding.ans import encode_bits
from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.morton import interleave

AnswerFunction = Callable[..., str]


@dataclass(frozen=True)
class VectorTable:
    """A table of known answers.

    Attributes:
        marker: Marker in the text: `<!-- spec:vectors marker -->`.
        head: Names of the columns, the answer last.
        inputs: Cells of each row without the answer.
        package: Function of the package that answers a row.
        independent: Independent function that answers a row, written from the specification.
    """

    marker: str
    head: tuple[str, ...]
    inputs: tuple[tuple[str, ...], ...]
    package: AnswerFunction
    independent: AnswerFunction

    def render(self) -> str:
        rows = [(*cells, self.package(*cells)) for cells in self.inputs]
        return f"<!-- spec:vectors {self.marker} -->\n" + render_table(self.head, rows)


def render_table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    text = "\n".join("| " + " | ".join(line) + " |" for line in lines)
    return text.replace("| --- |", "|---|").replace(" --- |", "---|").replace("|  |", "| |") + "\n"


def numbers(cell: str, base: int = 10) -> list[int]:
    return [int(number, base) for number in cell.replace(",", " ").split()]


def words(values: list[int]) -> str:
    return " ".join(f"{value:08x}" for value in values)


def join_values(values: object) -> str:
    return ", ".join(map(str, values))


def _column(values: list[int]) -> np.ndarray:
    return np.array(values, dtype=np.int64)[:, None]


def answer_philox(counter: str, key: str) -> str:
    k = numbers(key, 16)
    drawn = philox(np.array(numbers(counter, 16), dtype=np.uint64)[:, None], k[0] | k[1] << 32)
    return words(drawn[:, 0].tolist())


def answer_divide(numerator: str, denominator: str) -> str:
    return str(arithmetic.divide_round(np.int64(numerator), int(denominator)))


def answer_normalize(vector: str, guard: str) -> str:
    return join_values(_normalize(_column(numbers(vector)), int(guard))[:, 0].tolist())


def answer_expand(bits: str, index: str, others: str) -> str:
    coded = _column([int(index), *numbers(others)])
    return join_values(expand_rotations(coded, int(bits))[:, 0].tolist())


def answer_turn(rotation: str, sums: str) -> str:
    residual = normalize_sums(_column(numbers(sums)))
    rotated = rotate(_column(numbers(rotation)).astype(np.int32), residual)
    return join_values(rotated[:, 0].tolist())


def answer_encode(bits: str, weights: str) -> str:
    runs = [
        (np.array([bit == "1"]), weight)
        for bit, weight in zip(bits.replace(" ", ""), numbers(weights), strict=True)
    ]
    return words(encode_bits(runs)) or "none"


def answer_decode(bits: str, weights: str) -> str:
    """Return the words, after checking that they decode to these bits."""
    expected_words = answer_encode(bits, weights)
    coder = PlainBitDecoder(numbers(expected_words.replace("none", ""), 16))
    assert [coder.decode_bit(weight) for weight in numbers(weights)] == [
        int(b) for b in bits.split()
    ]
    assert coder.state == 0
    assert not coder.words
    return expected_words


def _count_bits(*pairs: tuple[int, int]) -> ContextCounts:
    """Return the counts of context 0 after planes with these numbers of zeros and ones."""
    counts = ContextCounts()
    for zeros, ones in pairs:
        counts.add_bits("model", np.array([0]), np.array([zeros]), np.array([ones]))
    return counts


def answer_weight(zeros: str, ones: str) -> str:
    return str(_count_bits((int(zeros), int(ones))).compute_weights("model", np.array([0]))[0])


def _pair(cell: str) -> tuple[int, int]:
    zeros, ones = numbers(cell)
    return zeros, ones


def answer_count(before: str, bits: str) -> str:
    counts = _count_bits(_pair(before), _pair(bits))
    return join_values(counts._counts_by_model["model"][:, 0].tolist())


def answer_slow_count(before: str, bits: str) -> str:
    zeros, ones = _pair(bits)
    return join_values(add_to_counts(list(_pair(before)), [0] * zeros + [1] * ones))


def answer_morton(point: str) -> str:
    return str(interleave(_column(numbers(point)))[0])


def answer_slow_morton(point: str) -> str:
    numbers_and_axes = [(v, 2 - axis) for axis, v in enumerate(numbers(point))]
    return str(
        sum(
            (v >> b & 1) << (3 * b + axis_bit)
            for v, axis_bit in numbers_and_axes
            for b in range(21)
        )
    )


def answer_dequantize(code: str, step: str) -> str:
    product = np.float32(int(code)) * np.array([int(step, 16)], "<u4").view("<f4")[0]
    return f"{product.view('<u4'):08x}"


def answer_slow_dequantize(code: str, step: str) -> str:
    """Compute in binary64, where the product of 16 and 24 bits is exact, and round once."""
    exact = float(np.array([int(step, 16)], "<u4").view("<f4")[0]) * int(code)
    return f"{np.float32(exact).view('<u4'):08x}"


def slow_crc(data: bytes) -> int:
    """Compute a CRC bit by bit, as in SPEC 4.5."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0xEDB88320 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF
