"""Slow and simple versions of the normative functions, in plain Python integers.

They were written from SPEC.md and share no code with quarc_ref, whose results must equal theirs.
"""

from math import isqrt

POSITION_OFFSET = 1 << 23
ROTATION_ONE = 1 << 22


def divide_round(numerator: int, denominator: int) -> int:
    """Return the integer nearest to the quotient; halves are rounded away from zero (SPEC 4.2)."""
    magnitude, remainder = divmod(abs(numerator), denominator)
    magnitude += 2 * remainder >= denominator
    return magnitude if numerator >= 0 else -magnitude


def normalize(vector: list[int], guard_bits: int) -> list[int]:
    """Return a vector of four integers as a unit quaternion in Q22 (SPEC 7.3)."""
    norm = isqrt(sum(v * v for v in vector) << (2 * guard_bits))
    return [divide_round(v << (22 + guard_bits), norm) for v in vector]


def multiply_quaternions(a: list[int], b: list[int]) -> list[int]:
    """Return the Hamilton product of two quaternions in wxyz order."""
    (aw, ax, ay, az), (bw, bx, by, bz) = a, b
    return [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    ]


def rotate(rotation: list[int], sums: list[int]) -> list[int]:
    """Return a rotation multiplied by the sums of its residuals, both in wxyz order (SPEC 7.5)."""
    residual = normalize(sums, 20)
    product = [divide_round(v, ROTATION_ONE) for v in multiply_quaternions(rotation, residual)]
    return normalize(product, 8)


def expand_rotation(largest_index: int, components: list[int], bits: int) -> list[int]:
    """Return the unit quaternion of a coded rotation, in Q22 (SPEC 7.2)."""
    scaled = [v << (22 - bits) for v in components]
    largest_component = isqrt((1 << 44) - sum(v * v for v in scaled))
    vector = [*scaled[:largest_index], largest_component, *scaled[largest_index:]]
    return normalize(vector, 8)


def philox(counter: list[int], key: list[int]) -> list[int]:
    """Return the four words of Philox4x32-10 (SPEC 6.2)."""
    mask = 0xFFFFFFFF
    c, k = list(counter), list(key)
    for _ in range(10):
        first, second = 0xD2511F53 * c[0], 0xCD9E8D57 * c[2]
        c = [(second >> 32) ^ c[1] ^ k[0], second & mask, (first >> 32) ^ c[3] ^ k[1], first & mask]
        k = [(k[0] + 0x9E3779B9) & mask, (k[1] + 0xBB67AE85) & mask]
    return c


def sample(
    ids: list[int], positions: list[tuple[int, ...]], phase: int, seed: int, level: int, count: int
) -> list[int]:
    """Return the indices of the anchors of a level, in ascending order (SPEC 6.3)."""
    key = [seed & 0xFFFFFFFF, seed >> 32]
    ranks = [(philox([i, phase, 0, 1], key)[level - 1], i) for i in ids]
    for shift in range(25):
        cells: dict[tuple[int, ...], list[int]] = {}
        for index, position in enumerate(positions):
            cell = tuple((p + POSITION_OFFSET) // (1 << shift) for p in position)
            cells.setdefault(cell, []).append(index)
        if len(cells) <= count:
            break
    anchors = {min(members, key=lambda index: ranks[index]) for members in cells.values()}
    remaining = sorted(
        (i for i in range(len(ids)) if i not in anchors), key=lambda index: ranks[index]
    )
    return sorted(anchors | set(remaining[: count - len(anchors)]))


def bind(positions: list[tuple[int, ...]], anchors: list[tuple[int, ...]]) -> list[int]:
    """Return the index of each position's nearest anchor; the lowest wins a tie (SPEC 6.4)."""
    return [
        min(
            range(len(anchors)),
            key=lambda a: (sum((p - q) ** 2 for p, q in zip(position, anchors[a], strict=True)), a),
        )
        for position in positions
    ]
