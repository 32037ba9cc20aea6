"""Makes known answers for coding and for states, for unit/ (SPEC 8, 9)."""

import zlib
from collections.abc import Iterable
from hashlib import sha256
from typing import Any

from making.payloads import Head
from making.scenes import hash_numbers, make_cloud, pick_between
from making.streams import Stream
from making.units import Input, Rejection, Unit
from making.writing import (
    Planes,
    WritingSection,
    encode,
    make_ascending_planes,
    make_fixed_planes,
    make_signed_planes,
    make_unsigned_planes,
)
from plain import planes
from plain.coder import add_to_counts, weight_from_code, weight_from_counts

_ZEROS_AND_ONES = (
    *((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (6, 1), (3, 4), (100, 3)),
    *((4095, 0), (4096, 0), (0, 4096), (2048, 2048)),
)
_COUNT_UPDATES = (
    *(((0, 0), (3, 2)), ((4000, 95), (1, 0)), ((4000, 95), (1, 1)), ((4000, 95), (0, 7))),
    *(((1, 4095), (0, 1)), ((0, 1), (8191, 0)), ((0, 0), (8191, 8193)), ((7, 0), (0, 65536))),
)
_ALTERNATING_CONTEXTS = {width: [k % width for k in range(60)] for width in (2, 3)}
"""Outer contexts of 60 values that cycle through 2 or 3 contexts."""
_FIXED_INPUTS = (
    ([0, 3, 1, 2], [0, 0, 1, 0], 2),
    ([3] * 30 + [2], [0] * 31, 2),
    (list(range(16)), _ALTERNATING_CONTEXTS[3][:16], 4),
)
_UNSIGNED_INPUTS = (
    ([0, 1, 5, 6, 200], [0, 0, 0, 0, 2], 4),
    ([(1 << 63) - 1, 1 << 62, 0], [0] * 3, 6),
    ([hash_numbers(k) >> (k % 30) for k in range(40)], _ALTERNATING_CONTEXTS[2][:40], 6),
)
_SIGNED_INPUTS = (
    ([0, -1, -6, 3], [0, 0, 0, 1], 4),
    ([32767, -32767, 0, -1], [0] * 4, 4),
    ([pick_between(-900, 900, k) >> (k % 9) for k in range(60)], _ALTERNATING_CONTEXTS[3], 4),
)


def make_coding_units() -> list[Unit]:
    """Return the known answers for entropy coding and for integers coded as planes."""
    return [*_make_weight_units(), *_make_bit_units()]


def _make_weight_units() -> list[Unit]:
    code_cases: list[tuple[Input, Any]] = [({"code": c}, weight_from_code(c)) for c in range(240)]
    code_cases += [({"code": c}, Rejection("bad-probability")) for c in (240, 255)]
    weight_cases = [({"zeros": z, "ones": o}, weight_from_counts(z, o)) for z, o in _ZEROS_AND_ONES]
    count_cases = [
        ({"before": list(b), "plane": [z, o]}, add_to_counts(list(b), [0] * z + [1] * o))
        for b, (z, o) in _COUNT_UPDATES
    ]
    weight_note = "the weight of a 1 in a context that has counted these zeros and ones"
    return [
        Unit(
            "weight_of_code", "the weight of a 1 for a stated probability code", "8.2-1", code_cases
        ),
        Unit("weight_by_counts", weight_note, "8.2", weight_cases),
        Unit(
            "counts",
            "the counts (zeros, ones) of a context after it has coded a plane",
            "8.2",
            count_cases,
        ),
    ]


def _make_bit_units() -> list[Unit]:
    bits_note = "the bits that words decode to; all words must be consumed"
    fixed_note = "numbers coded by Fixed(width) in the given outer contexts; all counts start at 0"
    ascending_note = "numbers coded by Ascending(6); all counts start at 0"
    return [
        Unit("decode_bits", bits_note, "8.3-1 8.3-2 8.3-3", _make_bit_cases()),
        Unit("fixed", fixed_note, "8.4", _make_integer_cases("fixed", _FIXED_INPUTS)),
        Unit(
            "unsigned",
            "numbers coded by Unsigned(width) in the given outer contexts; all counts start at 0",
            "8.4",
            _make_integer_cases("unsigned", _UNSIGNED_INPUTS),
        ),
        Unit(
            "signed",
            "numbers coded by Signed(width) in the given outer contexts; all counts start at 0",
            "8.4",
            _make_integer_cases("signed", _SIGNED_INPUTS),
        ),
        Unit("ascending", ascending_note, "8.4-1", _make_ascending_cases()),
    ]


def _make_bit_cases() -> list[tuple[Input, Any]]:
    runs = [
        ([0] * 4, [8388608, 8388608, 256, 1048576]),
        ([1], [8388608]),
        ([0, 1, 0, 1, 1], [4194304] * 3 + [8388608] * 2),
        ([1] * 6, [256] * 6),
        ([1, 0, 1, 1, 0, 1, 1], [16776960, 256, 15728640, 8388608, 7864320, 256, 256]),
    ]
    runs.append(
        (
            [hash_numbers(k) & 1 for k in range(200)],
            [1 + hash_numbers(k, 1) % ((1 << 24) - 1) for k in range(200)],
        )
    )
    cases: list[tuple[Input, Any]] = []
    for bits, weights in runs:
        words = encode(zip(bits, weights, strict=True))
        cases.append(({"words": words, "weights": weights}, bits))
    words, weights = encode(zip(*runs[-1], strict=True)), runs[-1][1]
    cases.append(({"words": [*words, 0], "weights": weights}, Rejection("invalid-words")))
    cases.append(({"words": [1, *words], "weights": weights}, Rejection("unconsumed-words")))
    cases.append(({"words": [0, *words], "weights": weights}, Rejection("unconsumed-words")))
    cases.append(({"words": [1], "weights": []}, Rejection("unconsumed-words")))
    cases.append(({"words": words[1:], "weights": weights}, Rejection("unconsumed-words")))
    return cases


_CODINGS = {
    "fixed": (make_fixed_planes, planes.read_fixed),
    "unsigned": (make_unsigned_planes, planes.read_unsigned),
    "signed": (make_signed_planes, planes.read_signed),
}
"""Functions that make and read the planes of each coding."""


def _make_integer_cases(
    coding_name: str, inputs: Iterable[tuple[list[int], list[int], int]]
) -> list[tuple[Input, Any]]:
    make_planes, read_numbers = _CODINGS[coding_name]
    cases: list[tuple[Input, Any]] = []
    for values, contexts, width in inputs:
        section = WritingSection("n", Planes(make_planes(values, width)), {})
        read_numbers(section, "n", contexts, width)
        section.close()
        cases.append(
            ({"words": section.written_words, "contexts": contexts, "width": width}, values)
        )
    return cases


def _make_ascending_cases() -> list[tuple[Input, Any]]:
    cases: list[tuple[Input, Any]] = []
    for values in (
        [3, 3, 10, 11],
        [0, 0, 0],
        [1 << 59, (1 << 60) - 1],
        [5 * k * k for k in range(50)],
    ):
        section = WritingSection("n", Planes(make_ascending_planes(values)), {})
        planes.read_ascending(section, "n", len(values), 6)
        section.close()
        cases.append(({"words": section.written_words, "count": len(values)}, values))
    section = WritingSection("n", Planes(make_unsigned_planes([(1 << 60) + 1, 0], 6)), {})
    planes.read_unsigned(section, "n", [0, 0], 6)
    section.close()
    cases.append(({"words": section.written_words, "count": 2}, Rejection("symbol-range")))
    return cases


def make_state_units() -> list[Unit]:
    """Return the known answers for the digests of states."""
    cases = []
    for sh_degree in (0, 1):
        stream = (
            Stream(Head(sh_degree=sh_degree))
            .add_canonical(0, make_cloud(3, 30, sh_degree))
            .add_frame()
        )
        for state in stream.states:
            assert state is not None
            gaussians = state.gaussians
            state_input = {
                "phase": state.phase,
                "ids": [g.id for g in gaussians],
                "positions": [g.position for g in gaussians],
                "rotations": [g.rotation for g in gaussians],
                "codes": [g.codes for g in gaussians],
            }
            digest = sha256(state.serialize()).hexdigest()
            cases.append(
                (
                    state_input,
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
            "the CRCs and the SHA-256 of a state; each list has one element per Gaussian",
            "9.2-1",
            cases,
        )
    ]
