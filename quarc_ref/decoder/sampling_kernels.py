"""The sampler of SPEC 6.2 and 6.3, compiled; `anchors` holds the plain twin.

Gaussians are sorted once by their Morton keys: by the 18 highest bits of the
three axes that are not the same in all, and the few that are still together
within a cell by the bits below.
"""

import numpy as np

from quarc_ref.format.compiled import entrance, plain

_OFFSET = 1 << 23
_AXIS_BITS = 18
_KEY_BITS = 72
_FEW = 24
_DIGIT_BITS = 14
_DIGITS = 1 << _DIGIT_BITS
_BUCKET_BITS = np.uint32(20)
_BUCKETS = 1 << 12
_WORD = np.uint64(0xFFFFFFFF)
_HALF = np.uint64(32)


@entrance
def draw_words(ids, phase, seed, domain):
    """Return uint32 `[3, N]`: the first three Philox words of every Gaussian (SPEC 6.2)."""
    words = np.empty((3, ids.size), dtype=np.uint32)
    for i in range(ids.size):
        c0, c1 = np.uint64(ids[i]), np.uint64(phase)
        c2, c3 = np.uint64(0), np.uint64(domain)
        k0, k1 = np.uint64(seed) & _WORD, np.uint64(seed) >> _HALF
        for _ in range(10):
            first, second = c0 * np.uint64(0xD2511F53), c2 * np.uint64(0xCD9E8D57)
            c0, c2 = (second >> _HALF) ^ c1 ^ k0, (first >> _HALF) ^ c3 ^ k1
            c1, c3 = second & _WORD, first & _WORD
            k0 = (k0 + np.uint64(0x9E3779B9)) & _WORD
            k1 = (k1 + np.uint64(0xBB67AE85)) & _WORD
        words[0, i], words[1, i], words[2, i] = c0, c1, c2
    return words


@entrance
def sort_cells(positions):
    """Return the Gaussians in Morton order, and when each joins its predecessor.

    Args:
        positions: int32 `[3, N]`.

    Returns:
        int32 `[N]` indices, those of equal positions ascending, and uint8
        `[N]` how many low bits of the key of each are not surely those of the
        one before it: 0 at the same place, 73 for the first.
    """
    count = positions.shape[1]
    low = max(0, _range_bits(positions) - _AXIS_BITS)
    keys, order = np.empty(count, dtype=np.uint64), np.empty(count, dtype=np.int32)
    mask = (1 << _AXIS_BITS) - 1
    for i in range(count):
        x, y, z = positions[0, i] + _OFFSET, positions[1, i] + _OFFSET, positions[2, i] + _OFFSET
        keys[i] = _interleave((x >> low) & mask, (y >> low) & mask, (z >> low) & mask)
        order[i] = i
    keys, order, spare = _sort(keys, order)
    merges = np.empty(count, dtype=np.uint8)
    merges[0] = _KEY_BITS + 1
    start = 0
    for i in range(1, count + 1):
        if i < count and keys[i] == keys[i - 1]:
            continue
        if i - start > 1:
            _sort_cell(positions, low, order, merges, spare, start, i)
        if i < count:
            merges[i] = 3 * low + _bit_length(keys[i] ^ keys[i - 1])
        start = i
    return order, merges


@entrance
def choose(words, order, merges, count):
    """Choose the anchors of a level (SPEC 6.3).

    Args:
        words: uint32 `[N]` of the level.
        order: As `sort_cells` gives it.
        merges: The same.
        count: How many anchors.

    Returns:
        bool `[N]` which Gaussians are anchors.
    """
    joined = np.zeros(_KEY_BITS + 2, dtype=np.int64)
    for merge in merges:
        joined[merge] += 1
    shared, occupied = 0, merges.size - joined[0]
    while occupied > count:
        occupied -= joined[shared + 1 : shared + 4].sum()
        shared += 3
    chosen = np.zeros(words.size, dtype=np.bool_)
    least = (np.uint64(words[order[0]]) << _HALF) | np.uint64(order[0])
    for i in range(1, order.size):
        rank = (np.uint64(words[order[i]]) << _HALF) | np.uint64(order[i])
        if merges[i] > shared:
            chosen[least & _WORD] = True
            least = rank
        least = min(least, rank)
    chosen[least & _WORD] = True
    _fill(words, chosen, count - occupied)
    return chosen


@plain
def _fill(words, chosen, missing):
    """Choose the least (word, index) of those that are not chosen yet."""
    if missing == 0:
        return
    buckets = np.zeros(_BUCKETS, dtype=np.int32)
    for i in range(words.size):
        buckets[words[i] >> _BUCKET_BITS] += not chosen[i]
    bucket = 0
    while buckets[bucket] < missing:
        missing -= buckets[bucket]
        bucket += 1
    last = np.empty(buckets[bucket], dtype=np.int64)
    found = 0
    for i in range(words.size):
        if words[i] >> _BUCKET_BITS == bucket and not chosen[i]:
            last[found] = (np.int64(words[i]) << 32) | i
            found += 1
    for i in range(words.size):
        chosen[i] |= words[i] >> _BUCKET_BITS < bucket
    last = np.sort(last)
    for rank in last[:missing]:
        chosen[rank & 0xFFFFFFFF] = True


@plain
def _range_bits(positions):
    """Return how many low bits of the coordinates are not the same in all positions."""
    differing = 0
    for axis in range(3):
        first = positions[axis, 0] + _OFFSET
        for value in positions[axis]:
            differing |= (value + _OFFSET) ^ first
    return _bit_length(np.uint64(differing))


@plain
def _sort_cell(positions, low, order, merges, keys, start, end):
    """Put Gaussians of one cell of side 2^low in Morton order; write all merges but the first."""
    mask = (1 << low) - 1
    for i in range(start, end):
        x, y, z = positions[0, order[i]], positions[1, order[i]], positions[2, order[i]]
        keys[i] = _interleave(x & mask, y & mask, z & mask)
    if end - start > _FEW:
        rearranged = np.argsort(keys[start:end], kind="mergesort")
        order[start:end] = order[start:end][rearranged]
        keys[start:end] = keys[start:end][rearranged]
    else:
        for i in range(start + 1, end):
            key, index, place = keys[i], order[i], i
            while place > start and keys[place - 1] > key:
                keys[place], order[place] = keys[place - 1], order[place - 1]
                place -= 1
            keys[place], order[place] = key, index
    for i in range(start + 1, end):
        merges[i] = _bit_length(keys[i] ^ keys[i - 1])


@plain
def _sort(keys, order):
    """Return keys in ascending order, an order that went along, and room for keys; stable."""
    count = order.size
    differing = np.uint64(0)
    for key in keys:
        differing |= key ^ keys[0]
    spare_keys, spare_order = np.empty_like(keys), np.empty_like(order)
    shift = np.uint64(0)
    digits = np.uint64(_DIGITS - 1)
    starts = np.empty(_DIGITS + 1, dtype=np.int32)
    while differing >> shift:
        starts[:] = 0
        for key in keys:
            starts[((key >> shift) & digits) + np.uint64(1)] += 1
        for digit in range(_DIGITS):
            starts[digit + 1] += starts[digit]
        for i in range(count):
            digit = (keys[i] >> shift) & digits  # without a sign it is looked up at once
            place = starts[digit]
            starts[digit] = place + 1
            spare_keys[place], spare_order[place] = keys[i], order[i]
        keys, spare_keys = spare_keys, keys
        order, spare_order = spare_order, order
        shift += np.uint64(_DIGIT_BITS)
    return keys, order, spare_keys


@plain
def _interleave(x, y, z):
    return (_spread(x) << np.uint64(2)) | (_spread(y) << np.uint64(1)) | _spread(z)


@plain
def _spread(number):
    """Return the bits of a number below 2^21 two places apart."""
    v = np.uint64(number)
    v = (v | (v << np.uint64(32))) & np.uint64(0x1F00000000FFFF)
    v = (v | (v << np.uint64(16))) & np.uint64(0x1F0000FF0000FF)
    v = (v | (v << np.uint64(8))) & np.uint64(0x100F00F00F00F00F)
    v = (v | (v << np.uint64(4))) & np.uint64(0x10C30C30C30C30C3)
    return (v | (v << np.uint64(2))) & np.uint64(0x1249249249249249)


@plain
def _bit_length(value):
    length = 0
    while value:
        value >>= np.uint64(1)
        length += 1
    return length
