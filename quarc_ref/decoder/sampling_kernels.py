"""The sampler of SPEC 6.2 and 6.3, compiled; `anchors` holds the plain twin.

Gaussians are sorted once by their Morton keys: by the 21 highest bits of the
three axes that are not the same in all, and the few that are still together
within a cell by the bits below.
"""

import numpy as np

from quarc_ref.format.compiled import entrance, plain

_OFFSET = 1 << 23
_AXIS_BITS = 21
_KEY_BITS = 72
MERGES = _KEY_BITS + 2  # how many numbers there are, of bits
_FEW = 24
_DIGIT_BITS = 16
_DIGITS = 1 << _DIGIT_BITS
_PASSES = 4
_BUCKET_BITS = np.uint32(20)
_BUCKETS = 1 << 12
_WORD = np.uint64(0xFFFFFFFF)
_HALF = np.uint64(32)


@entrance
def draw_words(ids, order, phase, seed, domain):
    """Return uint32 `[3, N]`: the first three Philox words of Gaussians in an order (SPEC 6.2)."""
    words = np.empty((3, order.size), dtype=np.uint32)
    drawn_for = np.empty(order.size, dtype=np.uint32)
    for i in range(order.size):
        drawn_for[i] = ids[order[i]]
    for i in range(order.size):
        c0, c1 = np.uint64(drawn_for[i]), np.uint64(phase)
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
def choose(words, order, merges, joined, count):
    """Choose the anchors of a level (SPEC 6.3).

    Args:
        words: uint32 `[N]` of the level, in Morton order.
        order: As `sort_cells` gives it.
        merges: The same.
        joined: int64 `[74]` how often each number is among these.
        count: How many anchors.

    Returns:
        bool `[N]` which Gaussians are anchors, in Morton order.
    """
    shared, occupied = 0, merges.size - joined[0]
    while occupied > count:
        occupied -= joined[shared + 1 : shared + 4].sum()
        shared += 3
    firsts = np.empty(occupied + 1, dtype=np.uint32)
    found, least, place = np.uint64(0), np.uint64(0), np.uint32(0)
    for i in range(order.size):  # without a branch; the last to be written of a cell stays
        rank = (np.uint64(words[i]) << _HALF) | np.uint64(order[i])
        begins = np.uint64(merges[i] > shared)
        found += begins
        least |= np.uint64(0) - begins  # more than any rank where a cell begins
        place = np.uint32(i) if rank < least else place
        least = min(least, rank)
        firsts[found] = place
    chosen = np.zeros(words.size, dtype=np.bool_)
    for k in range(1, occupied + 1):
        chosen[firsts[k]] = True
    if count > occupied:
        _fill(words, order, chosen, count - occupied)
    return chosen


@plain
def _fill(words, order, chosen, missing):
    """Choose the least (word, index) of those that are not chosen yet."""
    buckets = np.zeros(_BUCKETS, dtype=np.int32)
    for i in range(words.size):
        buckets[words[i] >> _BUCKET_BITS] += not chosen[i]
    bucket = 0
    while buckets[bucket] < missing:
        missing -= buckets[bucket]
        bucket += 1
    ranks = np.empty(buckets[bucket], dtype=np.int64)
    places = np.empty(ranks.size, dtype=np.uint32)
    found = 0
    for i in range(words.size):
        if words[i] >> _BUCKET_BITS == bucket and not chosen[i]:
            ranks[found], places[found] = (np.int64(words[i]) << 32) | order[i], i
            found += 1
    for i in range(words.size):
        chosen[i] |= words[i] >> _BUCKET_BITS < bucket
    last = np.sort(ranks)[missing - 1]
    for k in range(ranks.size):
        chosen[places[k]] |= ranks[k] <= last


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
    spare_keys, spare_order = np.empty_like(keys), np.empty_like(order)
    digits = np.uint64(_DIGITS - 1)
    begins = np.zeros((_PASSES, _DIGITS + 1), dtype=np.int32)
    for key in keys:
        for number in range(_PASSES):
            digit = (key >> np.uint64(number * _DIGIT_BITS)) & digits
            begins[number, digit + np.uint64(1)] += 1
    for number in range(_PASSES):
        shift, starts = np.uint64(number * _DIGIT_BITS), begins[number]
        if starts[((keys[0] >> shift) & digits) + np.uint64(1)] == keys.size:
            continue
        for digit in range(_DIGITS):
            starts[digit + 1] += starts[digit]
        for i in range(keys.size):
            digit = (keys[i] >> shift) & digits  # without a sign it is looked up at once
            place = np.uint32(starts[digit])
            starts[digit] = place + 1
            spare_keys[place], spare_order[place] = keys[i], order[i]
        keys, spare_keys = spare_keys, keys
        order, spare_order = spare_order, order
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
