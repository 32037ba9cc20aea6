"""Makes known answers of single functions, in plain integers, for unit/ (SPEC Annex F)."""

import struct
import zlib
from itertools import product
from math import isqrt

from making.planes import compute_morton_key
from making.scenes import make_cloud, pick_between
from making.unit_coding import make_coding_units, make_state_units
from making.units import Input, Rejection, Unit
from plain import oracle


def make_units() -> list[Unit]:
    """Return all units."""
    return [
        *_make_arithmetic_units(),
        *_make_rotation_units(),
        *_make_anchor_units(),
        *make_coding_units(),
        *make_state_units(),
    ]


def _make_arithmetic_units() -> list[Unit]:
    fractions = [
        (n, d)
        for d in (1, 2, 3, 4, 10, 1 << 22)
        for n in (-7, -6, -5, -3, -2, -1, 0, 1, 2, 3, 5, 6, 7)
    ]
    fractions += [
        ((1 << 52) - 1, 1 << 30),
        (-(1 << 61) + 1, 3),
        (-6291456, 4194304),
        (6291457, 4194304),
    ]
    square_root_inputs = [
        *range(20),
        *(r * r + d for r in (1 << 22, (1 << 26) + 1, 2147483647) for d in (-1, 0, 1)),
        1 << 62,
        (1 << 60) - 1,
    ]
    bit_length_inputs = [*range(10), 255, 256, (1 << 32) - 1, 1 << 32, (1 << 61) - 1, (1 << 62) - 1]
    crc_inputs = ["", "00", "ffffffff", "313233343536373839", "5155415243", bytes(range(256)).hex()]
    return [
        Unit(
            "divide_round",
            "the integer nearest to n / d; halves are rounded away from 0",
            "4.2",
            [({"n": n, "d": d}, oracle.divide_round(n, d)) for n, d in fractions],
        ),
        Unit(
            "isqrt",
            "the largest integer whose square is at most v",
            "4.3",
            [({"v": v}, isqrt(v)) for v in square_root_inputs],
        ),
        Unit(
            "bit_length",
            "the smallest b with v < 2^b",
            "4.4",
            [({"v": v}, v.bit_length()) for v in bit_length_inputs],
        ),
        Unit(
            "crc",
            "CRC-32 of bytes",
            "4.5",
            [
                ({"bytes": hex_bytes}, zlib.crc32(bytes.fromhex(hex_bytes)))
                for hex_bytes in crc_inputs
            ],
        ),
        Unit(
            "morton",
            "the Morton key of a position relative to the origin",
            "8.5",
            [
                ({"position": position}, compute_morton_key(position, (0, 0, 0)))
                for position in _list_positions()
            ],
        ),
        Unit(
            "dequantize",
            "code x step, rounded to binary32",
            "10.1-1",
            [
                ({"code": code, "step": step}, _dequantize(code, step))
                for code in (0, 1, -40, 3, -7, 32767, -32767)
                for step in ("3d800000", "3dcccccd", "3c23d70a", "00000001", "007fffff", "44800000")
            ],
        ),
    ]


def _list_positions() -> list[list[int]]:
    return [
        [0, 0, 0],
        [1, 0, 0],
        [0, 1, 0],
        [0, 0, 1],
        [5, 3, 6],
        [1000, 7, 64],
        [1048575, 0, 0],
        [0, 1048575, 524288],
        [1048575] * 3,
    ]


def _dequantize(code: int, step: str) -> str:
    dequantized = struct.unpack("<f", bytes.fromhex(step)[::-1])[0] * code
    return struct.pack("<f", dequantized)[::-1].hex()


def _make_rotation_units() -> list[Unit]:
    unnormalized_vectors = [
        [1, 0, 0, 0],
        [0, 0, -7, 0],
        [1, 1, 1, 1],
        [300, 1, 0, -1],
        [-192, 195, -195, 195],
        [963, 195, 195, 195],
        [-1, 2, -3, 4],
        [1, 0, 0, -1],
        [2, -1, 0, 2],
    ]
    rotations = [
        [2097152, 2097152, 2097152, 2097152],
        [4194304, 0, 0, 0],
        [-2965821, 2965820, 0, 0],
        [3, -4194304, 1, 0],
        [2097152, -2097152, 2097152, -2097152],
    ]
    sums = [
        [200, 0, 0, 20],
        [300, -1, 2, -3],
        [305, 0, 0, 0],
        [100, 65, -65, 64],
        [-64, 1, 0, 0],
        [1, 1, 1, 1],
        [1, -1, 1, 1],
        [-2, 0, 0, 0],
    ]
    coded_rotations = [
        (8, j, abc)
        for j in range(4)
        for abc in ([0, 0, 0], [12, -7, 90], [147, 147, -147], [0, -256, 0], [-100, 0, 100])
    ]
    coded_rotations += [(1, 1, [1, 1, -1]), (14, 3, [-8192, 8191, 1]), (14, 0, [16384, 0, 0])]
    too_long_rotations = [
        (8, 0, [257, 0, 0]),
        (8, 2, [256, 1, 0]),
        (8, 1, [-256, 0, 1]),
        (1, 3, [2, 2, 1]),
        (14, 2, [16384, 0, -1]),
    ]
    expand_cases = [
        ({"rotation_bits": bits, "j": j, "abc": abc}, oracle.expand_rotation(j, abc, bits))
        for bits, j, abc in coded_rotations
    ]
    expand_cases += [
        ({"rotation_bits": bits, "j": j, "abc": abc}, Rejection("rotation-range"))
        for bits, j, abc in too_long_rotations
    ]
    rotate_cases = [
        ({"rotation": q, "sums": s}, oracle.rotate(q, s)) for q in rotations for s in sums
    ]
    degenerate_cases = [
        ({"rotation": rotations[0], "sums": [0, 0, 0, 0]}, Rejection("degenerate-rotation"))
    ]
    return [
        Unit(
            "normalize",
            "the unit quaternion of a vector of four integers, with SUM_GUARD_BITS",
            "7.3-1",
            [({"vector": v}, oracle.normalize(v, 20)) for v in unnormalized_vectors]
            + [({"vector": [0] * 4}, Rejection("degenerate-rotation"))],
        ),
        Unit("expand", "the rotation expanded from j, a, b, c", "7.2-5 7.2-6", expand_cases),
        Unit(
            "turn",
            "a rotation multiplied by residuals, which are given as sums that include L x W",
            "7.5",
            rotate_cases + degenerate_cases,
        ),
    ]


def _make_anchor_units() -> list[Unit]:
    counters = [
        ([0] * 4, [0] * 2),
        ([0xFFFFFFFF] * 4, [0xFFFFFFFF] * 2),
        ([0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344], [0xA4093822, 0x299F31D0]),
        ([0, 1, 0, 1], [0x89ABCDEF, 0x01234567]),
        ([42, 300, 0, 1], [7, 0]),
    ]
    counters += [([i, 1, 0, 1], [5546942, 0]) for i in (1, 56)]
    count_inputs = [
        (40, 4, 3, 3),
        (1, 1, 2, 3),
        (7, 2, 2, 3),
        (41, 4, 3, 3),
        (5, 65535, 2, 3),
        (65536, 1, 65535, 3),
        (9, 1, 2, 2),
        (10, 4, 2, 1),
    ]
    return [
        Unit(
            "philox",
            "the four output words of Philox4x32-10",
            "6.2",
            [
                ({"counter": counter, "key": key}, oracle.philox(counter, key))
                for counter, key in counters
            ],
        ),
        Unit(
            "anchor_counts",
            "the numbers of anchors A_1 to A_L",
            "6.1",
            [
                (
                    {
                        "gaussians": n,
                        "gaussians_per_anchor": m,
                        "anchor_ratio": r,
                        "level_count": levels,
                    },
                    _count_anchors(n, m, r, levels),
                )
                for n, m, r, levels in count_inputs
            ],
        ),
        Unit(
            "sample",
            "the ids of the anchors of each level, level 1 first",
            "6.3",
            _make_sample_cases(),
        ),
        Unit(
            "bind",
            "the index of the anchor that each position follows",
            "6.4",
            [
                (
                    {"positions": positions, "anchors": anchors},
                    oracle.bind([tuple(q) for q in positions], [tuple(q) for q in anchors]),
                )
                for positions, anchors in _list_bind_inputs()
            ],
        ),
        Unit(
            "deaths",
            "the indices of the Gaussians that die, in ascending order; ids equal indices",
            "7.4",
            [
                (
                    {"opacities": opacities, "count": n},
                    sorted(sorted(range(len(opacities)), key=lambda i: (opacities[i], i))[:n]),
                )
                for opacities, n in _list_death_inputs()
            ],
        ),
    ]


def _count_anchors(
    gaussians: int, gaussians_per_anchor: int, anchor_ratio: int, level_count: int
) -> list[int]:
    anchor_counts = [-(-gaussians // gaussians_per_anchor)]
    while len(anchor_counts) < level_count:
        anchor_counts.append(max(1, anchor_counts[-1] // anchor_ratio))
    return anchor_counts


def _make_sample_cases() -> list[tuple[Input, list[list[int]]]]:
    grid = [list(p) for p in product((-1, 0, 1), repeat=3)]
    scattered_positions = [list(g.position) for g in make_cloud(30, 21, 0, 4000)]
    corners = [[s * 8388607 for s in p] for p in product((-1, 1), repeat=3)]
    tied_positions = [[160 * (i // 16), 0, 0] for i in range(57)]
    inputs = [
        (grid, 7, 1, 3, 2, 3),
        (scattered_positions, 1 << 63, 5, 4, 3, 3),
        (corners, 3, 1, 2, 2, 2),
        ([[5, 5, 5]] * 9, 1, 2, 2, 2, 3),
        ([[0, 0, 0]], 0, 1, 1, 2, 3),
        (tied_positions, 5546942, 1, 8, 2, 1),
    ]
    sample_cases = []
    for positions, seed, phase, gaussians_per_anchor, anchor_ratio, level_count in inputs:
        ids = (
            [2 * i for i in range(len(positions))]
            if positions is scattered_positions
            else list(range(len(positions)))
        )
        anchor_counts = _count_anchors(len(ids), gaussians_per_anchor, anchor_ratio, level_count)
        position_tuples = [tuple(p) for p in positions]
        anchor_ids = [
            [ids[i] for i in oracle.sample(ids, position_tuples, phase, seed, level, count)]
            for level, count in enumerate(anchor_counts, 1)
        ]
        sample_input = {"ids": ids, "positions": positions, "seed": seed, "phase": phase}
        sample_cases.append(
            (
                sample_input
                | {
                    "gaussians_per_anchor": gaussians_per_anchor,
                    "anchor_ratio": anchor_ratio,
                    "level_count": level_count,
                },
                anchor_ids,
            )
        )
    return sample_cases


def _list_bind_inputs() -> list[tuple[list[list[int]], list[list[int]]]]:
    grid = [list(point) for point in product((-1, 0, 1), repeat=3)]
    far_positions = [[-8388607, 0, 0], [8388607, 8388607, 8388607], [0, 0, 0]]
    far_anchors = [[8388606, 3, 0], [8388606, 2, 1], [8388606, 0, 2], [8388606, 1, 1]]
    scattered_positions = [list(gaussian.position) for gaussian in make_cloud(40, 22, 0, 900)]
    return [
        (grid, grid[::2]),
        (grid, [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]]),
        (far_positions, far_anchors),
        (scattered_positions, scattered_positions[::3]),
        ([[5, 5, 5]] * 3, [[9, 9, 9], [5, 5, 5], [5, 5, 5]]),
        (scattered_positions[:4], [[7, 7, 7]]),
    ]


def _list_death_inputs() -> list[tuple[list[int], int]]:
    return [
        ([5] * 6, 3),
        ([1, -1, 300, -300, 0, 32767, -32767], 4),
        ([2, 1, 2, 1, 2, 1], 4),
        ([7, 7], 0),
        ([pick_between(-2, 2, i) for i in range(40)], 17),
    ]
