"""Deaths, contexts and motion (SPEC 7.4, 7.5, 8.7), compiled; `reconstruct` has the plain twins."""

import numpy as np

from quarc_ref.decoder.turning_kernels import BLOCK, ONE, make_spare, turn_block
from quarc_ref.format.compiled import entrance, plain

_CODE_LIMIT = (1 << 15) - 1
_AXES = 3  # of translation; the channels after them are the rotation's
_DIGIT_BITS = 16
_DIGIT_ZERO = 1 << (_DIGIT_BITS - 2)  # added to digits, so that none is below 0
_ALL_ZERO = _DIGIT_ZERO * ((1 << (4 * _DIGIT_BITS)) // ((1 << _DIGIT_BITS) - 1))


@entrance
def find_least(codes, count):
    """Return int64 `[count]` the indices, ascending, of the least (code, index).

    Args:
        codes: int16 `[N]`, magnitudes up to 2^15 - 1.
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
            _copy(planes[row, first:last], kept[row, place:])
            place += last - first
            first = last + 1


@entrance
def recall(ids, owners, motion):
    """Return int16 `[c, a]` the motion of anchors' Gaussians, 0 of those that are dead.

    Args:
        ids: int64 `[N]` ascending.
        owners: int64 `[a]` ascending.
        motion: int16 `[c, N]`.
    """
    recalled = np.empty((motion.shape[0], owners.size), dtype=np.int16)
    places, alive = np.empty(BLOCK, dtype=np.uint32), np.empty(BLOCK, dtype=np.int16)
    place = 0
    for first in range(0, owners.size, BLOCK):
        block = owners[first : first + BLOCK]
        for j in range(block.size):
            # As far on as the id is, for ids ascend; less far, where some between have died.
            before, place = place, min(place + max(block[j] - ids[place], 0), ids.size - 1)
            if ids[place] > block[j]:
                within = np.searchsorted(ids[before:place], block[j], side="right")
                place = before + max(within - 1, 0)
            places[j], alive[j] = place, ids[place] == block[j]
        for channel in range(motion.shape[0]):
            plane, own = motion[channel], recalled[channel, first : first + BLOCK]
            for j in range(own.size):
                own[j] = plane[places[j]] * alive[j]
    return recalled


@entrance
def pack_symbols(symbols, packed, first):
    """Write a level's symbols int64 `[c, a]` as pairs of numbers to int64 `[A, 2]`, from `first`.

    Symbols are the digits to the base 2^16, the lowest first, of the translation's
    number and the rotation's. Digits may be negative, and so add up in one go.
    """
    own = packed[first : first + symbols.shape[1]]
    x, y, z, u, v, w = symbols[0], symbols[1], symbols[2], symbols[3], symbols[4], symbols[5]
    for anchor in range(x.size):
        own[anchor, 0] = x[anchor] + (y[anchor] << _DIGIT_BITS) + (z[anchor] << 2 * _DIGIT_BITS)
        own[anchor, 1] = u[anchor] + (v[anchor] << _DIGIT_BITS) + (w[anchor] << 2 * _DIGIT_BITS)
    for row in range(2 * _AXES, symbols.shape[0]):
        plane, place = symbols[row], np.int64(_place_of(row))
        for anchor in range(plane.size):
            own[anchor, 1] += plane[anchor] << place


@plain
def _copy(numbers, to):
    """Write numbers elsewhere: this becomes vectors, an assignment of slices does not."""
    for j in range(numbers.size):
        to[j] = numbers[j]


@plain
def _place_of(channel):
    """Return the lowest bit of a channel's digit."""
    return _DIGIT_BITS * (channel if channel < _AXES else channel - _AXES)


@entrance
def move(before, binding, anchors, steps, span, after):
    """Move Gaussians by their anchors.

    Args:
        before: int32 positions `[3, N]` and rotations `[4, N]`.
        binding: int32 `[L, N]`.
        anchors: Numbers int64 `[A, 2]` of all levels as `pack_symbols` writes them, and
            int64 `[L]` where each level begins.
        steps: Translation step, sum of the levels' unities, and the limit of a position.
        span: The first Gaussian, and the one after the last.
        after: int32 positions and rotations, and int16 motion `[c, N]`; written.

    Returns:
        Whether a Gaussian leaves the lattice, and whether a sum is degenerate.
    """
    step, unity, limit = steps
    positions, rotations, motion = after
    sums = np.empty((2, BLOCK), dtype=np.int64)
    turning = np.empty(span[1] - span[0], dtype=np.uint32)
    found = np.uint64(0)  # as a number without a sign it is looked up at once
    leaves = False
    for first in range(span[0], span[1], BLOCK):
        last = min(first + BLOCK, span[1])
        _add_up(binding, anchors, first, last, sums)
        for j in range(last - first):
            turning[found] = first + j
            found += np.uint64(sums[1, j] != _ALL_ZERO)
        for channel in range(motion.shape[0]):
            numbers, place = sums[min(channel // _AXES, 1)], _place_of(channel)
            _take_digits(numbers, place, motion[channel, first:last])
        for axis in range(_AXES):
            plane, moves = before[0][axis, first:last], motion[axis, first:last]
            leaves |= _shift(plane, moves, step, limit, positions[axis, first:last])
    for row in range(4):
        _copy(before[1][row, span[0] : span[1]], rotations[row, span[0] :])
    return leaves, _turn(turning[: np.int64(found)], motion[_AXES:], unity, rotations)


@plain
def _add_up(binding, anchors, first, last, sums):
    """Write the sums of the numbers of what some Gaussians follow, `_ALL_ZERO` added."""
    numbers, starts = anchors
    sums[:] = _ALL_ZERO
    shifts, turns = sums[0], sums[1]
    for level in range(binding.shape[0]):
        followed, own = binding[level, first:last], numbers[starts[level] :]
        for j in range(followed.size):
            anchor = np.uint32(followed[j])
            shifts[j] += own[anchor, 0]
            turns[j] += own[anchor, 1]


@plain
def _take_digits(numbers, place, digits):
    """Write the digits of numbers at a place."""
    for j in range(digits.size):
        number = np.uint64(numbers[j])  # what is shifted without a sign becomes vectors
        digits[j] = np.int16(np.uint16(number >> np.uint64(place))) - np.int16(_DIGIT_ZERO)


@plain
def _shift(plane, sums, step, limit, shifted):
    """Write a coordinate after the motion; tell whether one is beyond the limit."""
    farthest = np.int32(0)
    for j in range(plane.size):
        at = np.int32(plane[j] + np.int32(step) * np.int32(sums[j]))
        farthest = max(farthest, np.int32(abs(at)))
        shifted[j] = at
    return farthest > limit


@plain
def _turn(turning, sums, unity, rotations):
    """Turn those of rotations `[4, N]` that are listed; tell whether one cannot be."""
    quaternions = np.empty((4, BLOCK), dtype=np.int32)
    residuals = np.empty((4, BLOCK), dtype=np.int32)
    spare = make_spare()
    without = 4 - sums.shape[0]
    degenerate = False
    for first in range(0, turning.size, BLOCK):
        block = turning[first : first + BLOCK]
        quaternions[:, block.size :], residuals[:, block.size :] = ONE, 1  # as good as any
        residuals[0, : block.size] = 0
        for row in range(4):
            _gather(rotations[row], block, quaternions[row])
        for row in range(sums.shape[0]):
            _gather(sums[row], block, residuals[without + row])
        residuals[0, : block.size] += unity
        degenerate |= turn_block(quaternions, residuals, spare)
        for row in range(4):
            plane, turned = rotations[row], quaternions[row]
            for j in range(block.size):
                plane[block[j]] = turned[j]
    return degenerate


@plain
def _gather(plane, places, gathered):
    for j in range(places.size):
        gathered[j] = plane[places[j]]
