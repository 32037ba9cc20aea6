"""The inputs of Annex F's tables."""

import zlib
from math import isqrt

import numpy as np

from plain import oracle
from plain.coder import weight_from_code, weight_from_counts
from quarc_ref.format import arithmetic
from quarc_ref.format.coding.probability import weight_of_probability_code
from tests.spec import annex_vectors as vectors

_Q = "2097152, 2097152, 2097152, 2097152"
_UNIT = "4194304, 0, 0, 0"

TABLES = (
    vectors.VectorTable(
        "philox",
        ("counter", "key", "words"),
        (
            ("00000000 00000000 00000000 00000000", "00000000 00000000"),
            ("ffffffff ffffffff ffffffff ffffffff", "ffffffff ffffffff"),
            ("243f6a88 85a308d3 13198a2e 03707344", "a4093822 299f31d0"),
            ("00000000 00000001 00000000 00000001", "89abcdef 01234567"),
            ("0000002a 0000012c 00000000 00000001", "00000007 00000000"),
        ),
        vectors.answer_philox,
        lambda counter, key: vectors.words(
            oracle.philox(vectors.numbers(counter, 16), vectors.numbers(key, 16))
        ),
    ),
    vectors.VectorTable(
        "divide_round",
        ("n", "d", "divide_round(n, d)"),
        tuple(
            (str(n), str(d))
            for n, d in (
                *((0, 1), (1, 2), (-1, 2), (3, 2), (-3, 2), (1, 3), (2, 3), (-2, 3), (7, 4)),
                *((-5, 10), (4194303, 4194304), (-6291456, 4194304)),
                *(((1 << 52) - 1, 1 << 30), (-(1 << 61) + 1, 3)),
            )
        ),
        vectors.answer_divide,
        lambda n, d: str(oracle.divide_round(int(n), int(d))),
    ),
    vectors.VectorTable(
        "isqrt",
        ("v", "isqrt(v)"),
        tuple(
            (str(v),)
            for v in (
                *(0, 1, 2, 3, 4, 99, 1 << 44, (1 << 44) - 1, (1 << 52) + (1 << 27)),
                *((1 << 60) - 1, 2147483647**2 - 1, 2147483647**2, 1 << 62),
            )
        ),
        lambda v: str(arithmetic.isqrt(np.array([int(v)]))[0]),
        lambda v: str(isqrt(int(v))),
    ),
    vectors.VectorTable(
        "crc",
        ("bytes", "CRC"),
        (
            ("none",),
            ("00",),
            ("ff ff ff ff",),
            ("31 32 33 34 35 36 37 38 39",),
            ("51 55 41 52 43",),
        ),
        lambda data: f"0x{zlib.crc32(bytes.fromhex(data.replace('none', ''))):08X}",
        lambda data: f"0x{vectors.slow_crc(bytes.fromhex(data.replace('none', ''))):08X}",
    ),
    vectors.VectorTable(
        "normalize",
        ("vector w, x, y, z", "guard bits", "normalized"),
        (
            ("1, 0, 0, 0", "20"),
            ("0, 0, -7, 0", "20"),
            ("1, 1, 1, 1", "20"),
            ("300, 1, 0, -1", "20"),
            ("200, 0, 0, 20", "20"),
            ("-192, 195, -195, 195", "20"),
            ("963, 195, 195, 195", "20"),
            ("4194304, 0, 0, 0", "8"),
            ("4194303, 1, -1, 1", "8"),
            ("2965821, 2965820, -3, 2", "8"),
            ("-1, 2, -3, 4", "8"),
        ),
        vectors.answer_normalize,
        lambda vector, guard: vectors.join_values(
            oracle.normalize(vectors.numbers(vector), int(guard))
        ),
    ),
    vectors.VectorTable(
        "expand",
        ("rotation_bits", "j", "a, b, c", "rotation w, x, y, z"),
        (
            ("8", "0", "0, 0, 0"),
            ("8", "0", "12, -7, 90"),
            ("8", "1", "12, -7, 90"),
            ("8", "2", "100, 0, -100"),
            ("8", "3", "147, 147, -147"),
            ("8", "2", "0, -256, 0"),
            ("1", "1", "1, 1, -1"),
            ("14", "3", "-8192, 8191, 1"),
        ),
        vectors.answer_expand,
        lambda bits, j, abc: vectors.join_values(
            oracle.expand_rotation(int(j), vectors.numbers(abc), int(bits))
        ),
    ),
    vectors.VectorTable(
        "turn",
        ("rotation before", "L x W + W', X, Y, Z", "rotation after"),
        (
            (_UNIT, "200, 0, 0, 20"),
            (_UNIT, "300, -1, 2, -3"),
            (_Q, "300, -1, 2, -3"),
            (_Q, "305, 0, 0, 0"),
            ("-2965821, 2965820, 0, 0", "100, 65, -65, 64"),
            ("3, -4194304, 1, 0", "-64, 1, 0, 0"),
        ),
        vectors.answer_turn,
        lambda q, sums: vectors.join_values(
            oracle.rotate(vectors.numbers(q), vectors.numbers(sums))
        ),
    ),
    vectors.VectorTable(
        "weights",
        ("zeros", "ones", "weight of a 1"),
        (
            *(("0", "0"), ("1", "0"), ("0", "1"), ("2", "0"), ("1", "1"), ("6", "1"), ("3", "4")),
            *(("100", "3"), ("4095", "0"), ("4096", "0"), ("0", "4096"), ("2048", "2048")),
        ),
        vectors.answer_weight,
        lambda zeros, ones: str(weight_from_counts(int(zeros), int(ones))),
    ),
    vectors.VectorTable(
        "counts",
        ("zeros, ones before", "zeros, ones of the plane", "zeros, ones after"),
        (
            *(("0, 0", "3, 2"), ("4000, 95", "1, 0"), ("4000, 95", "1, 1"), ("4000, 95", "0, 7")),
            *(
                ("1, 4095", "0, 1"),
                ("0, 1", "8191, 0"),
                ("0, 0", "8191, 8193"),
                ("7, 0", "0, 65536"),
            ),
        ),
        vectors.answer_count,
        vectors.answer_slow_count,
    ),
    vectors.VectorTable(
        "coder",
        ("bits, first to last", "weights of a 1", "words in stored order"),
        (
            ("0 0 0 0", "8388608 8388608 256 1048576"),
            ("1", "8388608"),
            ("0 1 0 1 1", "4194304 4194304 4194304 8388608 8388608"),
            ("1 1 1 1 1 1", "256 256 256 256 256 256"),
            ("1 0 1 1 0 1 1", "16776960 256 15728640 8388608 7864320 256 256"),
        ),
        vectors.answer_encode,
        vectors.answer_decode,
    ),
    vectors.VectorTable(
        "morton",
        ("x, y, z", "key"),
        (
            *(("0, 0, 0",), ("1, 0, 0",), ("0, 1, 0",), ("0, 0, 1",), ("5, 3, 6",)),
            *(("1000, 7, 64",), ("1048575, 0, 0",), ("1048575, 1048575, 1048575",)),
        ),
        vectors.answer_morton,
        vectors.answer_slow_morton,
    ),
    vectors.VectorTable(
        "dequantize",
        ("code", "step, as stored", "number, as binary32"),
        (
            ("0", "3d800000"),
            ("-40", "3d800000"),
            ("32767", "3dcccccd"),
            ("3", "3dcccccd"),
            ("-7", "3c23d70a"),
        ),
        vectors.answer_dequantize,
        vectors.answer_slow_dequantize,
    ),
)


def codes_table() -> str:
    """Return the table of the weights of codes 0 to 119, with a row for each octave."""
    head = ("codes", *(f"m = {m}" for m in range(8)))
    rows = [
        (f"{8 * e} to {8 * e + 7}", *(str(weight_of_probability_code(8 * e + m)) for m in range(8)))
        for e in range(15)
    ]
    assert all(weight_of_probability_code(code) == weight_from_code(code) for code in range(240))
    return "<!-- spec:vectors codes -->\n" + vectors.render_table(head, rows)
