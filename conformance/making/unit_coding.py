"""unit/: known answers for coding and for states (SPEC 8, 9)."""

import zlib
from collections.abc import Iterable
from hashlib import sha256
from typing import Any

from making.payloads import Head
from making.scenes import between, cloud, pick
from making.streams import Stream
from making.units import Input, Refusal, Unit
from making.writing import Planes, WritingSection, ascending, encode, fixed, signed, unsigned
from plain import planes
from plain.coder import add_to_counts, weight_from_code, weight_from_counts

_SEEN = (
    *((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (6, 1), (3, 4), (100, 3)),
    *((4095, 0), (4096, 0), (0, 4096), (2048, 2048)),
)
_COUNTED = (
    *(((0, 0), (3, 2)), ((4000, 95), (1, 0)), ((4000, 95), (1, 1)), ((4000, 95), (0, 7))),
    *(((1, 4095), (0, 1)), ((0, 1), (8191, 0)), ((0, 0), (8191, 8193)), ((7, 0), (0, 65536))),
)
_TURNS = {width: [k % width for k in range(60)] for width in (2, 3)}
"""Alternating outer contexts."""
_FIXED = (
    ([0, 3, 1, 2], [0, 0, 1, 0], 2),
    ([3] * 30 + [2], [0] * 31, 2),
    (list(range(16)), _TURNS[3][:16], 4),
)
_UNSIGNED = (
    ([0, 1, 5, 6, 200], [0, 0, 0, 0, 2], 4),
    ([(1 << 63) - 1, 1 << 62, 0], [0] * 3, 6),
    ([pick(k) >> (k % 30) for k in range(40)], _TURNS[2][:40], 6),
)
_SIGNED = (
    ([0, -1, -6, 3], [0, 0, 0, 1], 4),
    ([32767, -32767, 0, -1], [0] * 4, 4),
    ([between(-900, 900, k) >> (k % 9) for k in range(60)], _TURNS[3], 4),
)


def make_coding() -> list[Unit]:
    """Return the answers for the coder and for integers as planes."""
    return [*_of_weights(), *_of_bits()]


def _of_weights() -> list[Unit]:
    codes: list[tuple[Input, Any]] = [({"code": c}, weight_from_code(c)) for c in range(240)]
    codes += [({"code": c}, Refusal("bad-probability")) for c in (240, 255)]
    weights = [({"zeros": z, "ones": o}, weight_from_counts(z, o)) for z, o in _SEEN]
    counts = [
        ({"before": list(b), "plane": [z, o]}, add_to_counts(list(b), [0] * z + [1] * o))
        for b, (z, o) in _COUNTED
    ]
    by_counts = "the weight of a 1, from the zeros and ones of a context"
    return [
        Unit("weight_of_code", "the weight of a 1, from a stated code", "8.2-1", codes),
        Unit("weight_by_counts", by_counts, "8.2", weights),
        Unit("counts", "the zeros and ones of a context after a plane", "8.2", counts),
    ]


def _of_bits() -> list[Unit]:
    bits = "the bits of words, all of which must be used"
    first = "numbers by Fixed(width) in outer contexts, from counts of 0"
    last = "numbers by Ascending(6), from counts of 0"
    return [
        Unit("decode_bits", bits, "8.3-1 8.3-2 8.3-3", _coded()),
        Unit("fixed", first, "8.4", _forms("fixed", _FIXED)),
        Unit(
            "unsigned", "numbers by Unsigned(width), likewise", "8.4", _forms("unsigned", _UNSIGNED)
        ),
        Unit("signed", "numbers by Signed(width), likewise", "8.4", _forms("signed", _SIGNED)),
        Unit("ascending", last, "8.4-1", _ascended()),
    ]


def _coded() -> list[tuple[Input, Any]]:
    runs = [
        ([0] * 4, [8388608, 8388608, 256, 1048576]),
        ([1], [8388608]),
        ([0, 1, 0, 1, 1], [4194304] * 3 + [8388608] * 2),
        ([1] * 6, [256] * 6),
        ([1, 0, 1, 1, 0, 1, 1], [16776960, 256, 15728640, 8388608, 7864320, 256, 256]),
    ]
    runs.append(
        ([pick(k) & 1 for k in range(200)], [1 + pick(k, 1) % ((1 << 24) - 1) for k in range(200)])
    )
    made: list[tuple[Input, Any]] = []
    for bits, weights in runs:
        words = encode(zip(bits, weights, strict=True))
        made.append(({"words": words, "weights": weights}, bits))
    words, weights = encode(zip(*runs[-1], strict=True)), runs[-1][1]
    made.append(({"words": [*words, 0], "weights": weights}, Refusal("invalid-words")))
    made.append(({"words": [1, *words], "weights": weights}, Refusal("unconsumed-words")))
    made.append(({"words": [0, *words], "weights": weights}, Refusal("unconsumed-words")))
    made.append(({"words": [1], "weights": []}, Refusal("unconsumed-words")))
    made.append(({"words": words[1:], "weights": weights}, Refusal("unconsumed-words")))
    return made


_MAKERS = {"fixed": fixed, "unsigned": unsigned, "signed": signed}


def _forms(form: str, given: Iterable[tuple[list[int], list[int], int]]) -> list[tuple[Input, Any]]:
    made: list[tuple[Input, Any]] = []
    for values, contexts, width in given:
        section = WritingSection("n", Planes(_MAKERS[form](values, width)), {})
        getattr(planes, form)(section, "n", contexts, width)
        section.close()
        made.append(({"words": section.written, "contexts": contexts, "width": width}, values))
    return made


def _ascended() -> list[tuple[Input, Any]]:
    made: list[tuple[Input, Any]] = []
    for values in (
        [3, 3, 10, 11],
        [0, 0, 0],
        [1 << 59, (1 << 60) - 1],
        [5 * k * k for k in range(50)],
    ):
        section = WritingSection("n", Planes(ascending(values)), {})
        planes.ascending(section, "n", len(values), 6)
        section.close()
        made.append(({"words": section.written, "count": len(values)}, values))
    section = WritingSection("n", Planes(unsigned([(1 << 60) + 1, 0], 6)), {})
    planes.unsigned(section, "n", [0, 0], 6)
    section.close()
    made.append(({"words": section.written, "count": 2}, Refusal("symbol-range")))
    return made


def make_states() -> list[Unit]:
    """Return the answers for serialization."""
    cases = []
    for degree in (0, 1):
        stream = Stream(Head(sh_degree=degree)).canonical(0, cloud(3, 30, degree)).frame()
        for state in stream.states:
            assert state is not None
            rows = state.gaussians
            given = {
                "phase": state.phase,
                "ids": [g.id for g in rows],
                "positions": [g.position for g in rows],
                "rotations": [g.rotation for g in rows],
                "codes": [g.codes for g in rows],
            }
            digest = sha256(state.serialize()).hexdigest()
            cases.append(
                (
                    given,
                    {
                        "crc_all": zlib.crc32(state.serialize()),
                        "crc_without_codes": zlib.crc32(state.serialize(codes=False)),
                        "sha256": digest,
                    },
                )
            )
    return [
        Unit(
            "digest",
            "CRCs and SHA-256 of a state; a row of each list is a Gaussian",
            "9.2-1",
            cases,
        )
    ]
