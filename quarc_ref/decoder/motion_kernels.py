"""Deaths, contexts and motion (SPEC 7.4, 7.5, 8.7), compiled; `reconstruct` has the plain twins."""

import numpy as np

from quarc_ref.format.compiled import entrance, plain

_CODE_LIMIT = (1 << 15) - 1
_ONE = 1 << 22
_SUM_GUARD = 20
_PRODUCT_GUARD = 8


@entrance
def find_least(codes, count):
    """Return int64 `[count]` the indices, ascending, of the least (code, index).

    Args:
        codes: int32 `[N]`, magnitudes up to 2^15 - 1.
        count: How many, up to N.
    """
    buckets = np.zeros(2 * _CODE_LIMIT + 1, dtype=np.int64)
    for code in codes:
        buckets[code + _CODE_LIMIT] += 1
    bucket, left = 0, count
    while bucket < buckets.size - 1 and buckets[bucket] < left:
        left -= buckets[bucket]
        bucket += 1
    found = np.empty(count, dtype=np.int64)
    place = 0
    for i in range(codes.size):
        below = codes[i] + _CODE_LIMIT
        if place < count and (below < bucket or (below == bucket and left > 0)):
            left -= below == bucket
            found[place] = i
            place += 1
    return found


@entrance
def remove(planes, gone):
    """Return planes `[r, N - g]` without some columns, `gone` int64 `[g]` ascending."""
    kept = np.empty((planes.shape[0], planes.shape[1] - gone.size), dtype=planes.dtype)
    for row in range(planes.shape[0]):
        first, place = 0, 0
        for i in range(gone.size + 1):
            last = gone[i] if i < gone.size else planes.shape[1]
            kept[row, place : place + last - first] = planes[row, first:last]
            place += last - first
            first = last + 1
    return kept


@entrance
def recall(ids, owners, motion):
    """Return int64 `[c, a]` the motion of anchors' Gaussians, 0 of those that are dead.

    Args:
        ids: int64 `[N]` ascending.
        owners: int64 `[a]` ascending.
        motion: int16 `[c, N]`.
    """
    recalled = np.zeros((motion.shape[0], owners.size), dtype=np.int64)
    place = 0
    for anchor in range(owners.size):
        while place < ids.size and ids[place] < owners[anchor]:
            place += 1
        if place < ids.size and ids[place] == owners[anchor]:
            for channel in range(motion.shape[0]):
                recalled[channel, anchor] = motion[channel, place]
    return recalled


@entrance
def pack_symbols(symbols, packed, moving, first):
    """Write a level's symbols int64 `[c, a]` to rows of `packed`, and which anchors move."""
    for anchor in range(symbols.shape[1]):
        moves = False
        for channel in range(symbols.shape[0]):
            packed[first + anchor, channel] = symbols[channel, anchor]
            moves |= symbols[channel, anchor] != 0
        moving[first + anchor] = moves


@entrance
def move(before, binding, anchors, steps, span, after):
    """Move Gaussians by their anchors.

    Args:
        before: int32 positions `[3, N]` and rotations `[4, N]`.
        binding: int64 `[L, N]`.
        anchors: Rows of symbols int16 `[A, c]` of all levels, which of them
            move bool `[A]`, and int64 `[L]` where each level begins.
        steps: Translation step, sum of the levels' unities, and the limit of a position.
        span: The first Gaussian, and the one after the last.
        after: int32 positions and rotations, and int16 motion `[c, N]`; written.

    Returns:
        Whether a Gaussian leaves the lattice, and whether a sum is degenerate.
    """
    positions, rotations = before
    rows, moving, starts = anchors
    step, unity, limit = steps
    new_positions, new_rotations, motion = after
    channels, levels = rows.shape[1], binding.shape[0]
    for plane in range(3):
        new_positions[plane, span[0] : span[1]] = positions[plane, span[0] : span[1]]
    for plane in range(4):
        new_rotations[plane, span[0] : span[1]] = rotations[plane, span[0] : span[1]]
    motion[:, span[0] : span[1]] = 0
    sums = np.zeros(8, dtype=np.int64)
    leaves = degenerate = False
    for i in range(span[0], span[1]):
        moves = False
        for level in range(levels):
            moves |= moving[starts[level] + binding[level, i]]
        if not moves:
            continue
        sums[:] = 0
        for level in range(levels):
            row = starts[level] + binding[level, i]
            for channel in range(channels):
                sums[channel] += rows[row, channel]
        for channel in range(channels):
            motion[channel, i] = sums[channel]
        for axis in range(3):
            moved = positions[axis, i] + step * sums[axis]
            leaves |= abs(moved) > limit
            new_positions[axis, i] = moved
        w = sums[3] if channels == 7 else 0
        x, y, z = sums[channels - 3], sums[channels - 2], sums[channels - 1]
        if w or x or y or z:
            q = (rotations[0, i], rotations[1, i], rotations[2, i], rotations[3, i])
            q, failed = _turn(q, (unity + w, x, y, z))
            degenerate |= failed
            new_rotations[0, i], new_rotations[1, i] = q[0], q[1]
            new_rotations[2, i], new_rotations[3, i] = q[2], q[3]
    return leaves, degenerate


@plain
def _turn(q, sums):
    """Return a rotation turned by a sum of residuals, and whether one of them has norm zero."""
    d, failed = _normalize(sums, _SUM_GUARD)
    aw, ax, ay, az = np.int64(q[0]), np.int64(q[1]), np.int64(q[2]), np.int64(q[3])
    bw, bx, by, bz = np.int64(d[0]), np.int64(d[1]), np.int64(d[2]), np.int64(d[3])
    product = (
        _divide_round(aw * bw - ax * bx - ay * by - az * bz, _ONE),
        _divide_round(aw * bx + ax * bw + ay * bz - az * by, _ONE),
        _divide_round(aw * by - ax * bz + ay * bw + az * bx, _ONE),
        _divide_round(aw * bz + ax * by - ay * bx + az * bw, _ONE),
    )
    turned, failed_too = _normalize(product, _PRODUCT_GUARD)
    return turned, failed or failed_too


@plain
def _normalize(v, guard):
    """Return the unit quaternion along a vector, Q22, and whether it has none."""
    squared = v[0] * v[0] + v[1] * v[1] + v[2] * v[2] + v[3] * v[3]
    if squared == 0:
        return (np.int32(0), np.int32(0), np.int32(0), np.int32(0)), True
    norm, scale = _isqrt(squared << (2 * guard)), 1 << (22 + guard)
    return (
        np.int32(_divide_round(v[0] * scale, norm)),
        np.int32(_divide_round(v[1] * scale, norm)),
        np.int32(_divide_round(v[2] * scale, norm)),
        np.int32(_divide_round(v[3] * scale, norm)),
    ), False


@plain
def _divide_round(numerator, denominator):
    quotient = (2 * abs(numerator) + denominator) // (2 * denominator)
    return quotient if numerator >= 0 else -quotient


@plain
def _isqrt(value):
    """Return the integer root; the floating-point one is a guess that integers correct."""
    root = np.int64(np.sqrt(value))
    root -= root * root > value
    root += (root + 1) * (root + 1) <= value
    return root
