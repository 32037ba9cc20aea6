"""Deaths, contexts and motion (SPEC 7.4, 7.5, 8.7), compiled; `reconstruct` has the plain twins."""

import numpy as np

from quarc_ref.decoder.turning_kernels import BLOCK, ONE, turn_block
from quarc_ref.format.compiled import entrance, plain

_CODE_LIMIT = (1 << 15) - 1
# Symbols of a row: those of 7 channels at most, and a last one that is 0, for the sake of vectors.
SYMBOLS = 8


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
def remove(planes, gone, kept):
    """Write planes `[r, N]` without some columns, `gone` int64 `[g]` ascending, to others."""
    for row in range(planes.shape[0]):
        first, place = 0, 0
        for i in range(gone.size + 1):
            last = gone[i] if i < gone.size else planes.shape[1]
            kept[row, place : place + last - first] = planes[row, first:last]
            place += last - first
            first = last + 1


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
        binding: int32 `[L, N]`.
        anchors: Rows of symbols int16 `[A, SYMBOLS]` of all levels, which of them
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
    new_positions[:, span[0] : span[1]] = positions[:, span[0] : span[1]]
    new_rotations[:, span[0] : span[1]] = rotations[:, span[0] : span[1]]
    motion[:, span[0] : span[1]] = 0
    moved = _list_moved(binding, moving, starts, span)
    _add_up(moved, binding, rows, starts, motion)
    leaves = False
    for axis in range(3):
        plane, sums = new_positions[axis], motion[axis]
        for i in moved:
            at = plane[i] + step * sums[i]
            leaves |= abs(at) > limit
            plane[i] = at
    return leaves, _turn(moved, motion[3:], unity, new_rotations)


@plain
def _list_moved(binding, moving, starts, span):
    """Return uint32 `[n]` which Gaussians of a span have an anchor that moves."""
    moved = np.empty(span[1] - span[0], dtype=np.uint32)
    found = 0
    for i in range(span[0], span[1]):
        moves = False
        for level in range(binding.shape[0]):
            moves |= moving[starts[level] + binding[level, i]]
        moved[found] = i
        found += moves
    return moved[:found]


@plain
def _add_up(moved, binding, rows, starts, motion):
    """Write the sums over the levels of the symbols of those that are listed."""
    sums = np.empty(SYMBOLS, dtype=np.int16)
    for i in moved:
        sums[:] = 0
        for level in range(binding.shape[0]):
            row = rows[starts[level] + binding[level, i]]
            for channel in range(SYMBOLS):
                sums[channel] += row[channel]
        for channel in range(motion.shape[0]):
            motion[channel, i] = sums[channel]


@plain
def _turn(moved, sums, unity, rotations):
    """Turn those of rotations `[4, N]` that are listed and have a sum; tell whether one cannot."""
    turning = _list_turning(moved, sums)
    quaternions = np.empty((4, BLOCK), dtype=np.int64)
    residuals = np.empty((4, BLOCK), dtype=np.int64)
    spare = np.empty(BLOCK, dtype=np.int64)
    without = 4 - sums.shape[0]
    degenerate = False
    for first in range(0, turning.size, BLOCK):
        block = turning[first : first + BLOCK]
        residuals[0, : block.size] = 0
        for j in range(block.size):
            for row in range(4):
                quaternions[row, j] = rotations[row, block[j]]
            for row in range(sums.shape[0]):
                residuals[without + row, j] = sums[row, block[j]]
        residuals[0, : block.size] += unity
        quaternions[:, block.size :], residuals[:, block.size :] = ONE, 1  # as good as any
        degenerate |= turn_block(quaternions, residuals, spare)
        for j in range(block.size):
            for row in range(4):
                rotations[row, block[j]] = quaternions[row, j]
    return degenerate


@plain
def _list_turning(moved, sums):
    """Return uint32 `[n]` those that are listed and whose rotation has a sum that is not 0."""
    turning = np.empty(moved.size, dtype=np.uint32)
    found = 0
    for i in moved:
        turns = False
        for row in range(sums.shape[0]):
            turns |= sums[row, i] != 0
        turning[found] = i
        found += turns
    return turning[:found]
