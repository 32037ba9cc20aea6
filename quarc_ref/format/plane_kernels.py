"""A plane of bits in contexts (SPEC 8.1 to 8.3), compiled; `planes` and `ans` are its twins.

A coder is four things: uint32 the words of a section; uint64 `[2]` its state and
how many words are left, which move on; above which counts are halved; and int64
`[k]` the weight of each probability code.
"""

import numpy as np

from quarc_ref.format.compiled import entrance, plain

_WEIGHT_BITS = np.uint64(24)
_WEIGHT_TOTAL = 1 << 24
_WEIGHT_MASK = np.uint64(_WEIGHT_TOTAL - 1)
_WORD_BITS = np.uint64(32)
_CODE_BITS = 8
_STATED = 1 << 18
_EVEN = 1 << 23


@entrance
def read_plane(coder, contexts, counts):
    """Return the answers bool `[n]` of a plane.

    Args:
        coder: Moves on.
        contexts: Integers `[n]`, n at least 1.
        counts: int64 `[2, c]` zeros and ones that each context has seen; learns.

    Returns:
        The answers, and a probability code that is undefined, -1 if none is.
    """
    words, cursor, count_limit, code_weights = coder
    used = contexts.max() + 1
    lengths = np.zeros(used + 1, dtype=np.int64)
    for context in contexts:
        lengths[context + 1] += 1
    stated = np.zeros(used, dtype=np.bool_)
    for context in range(used):
        if lengths[context + 1]:
            stated[context] = _take(words, cursor, _STATED)
    weights = np.empty(used, dtype=np.int64)
    for context in range(used):
        zeros, ones = counts[0, context], counts[1, context]
        weights[context] = ((2 * ones + 1) << 24) // (2 * (zeros + ones) + 2)
        if stated[context]:
            code = 0
            for _ in range(_CODE_BITS):
                code = 2 * code + _take(words, cursor, _EVEN)
            if code >= code_weights.size:
                return np.empty(0, dtype=np.bool_), code
            weights[context] = code_weights[code]
    places = np.cumsum(lengths)
    order = np.empty(contexts.size, dtype=np.int32)
    for i in range(contexts.size):
        place = places[contexts[i]]
        order[place] = i
        places[contexts[i]] = place + 1
    answers = np.empty(contexts.size, dtype=np.bool_)
    first = 0
    for context in range(used):
        last = first + lengths[context + 1]
        if last > first:
            ones = _take_run(words, cursor, weights[context], order, first, last, answers)
            _learn(counts, context, last - first - ones, ones, count_limit)
        first = last
    return answers, -1


@entrance
def read_raw(coder, count):
    """Return bool `[count]` bits that are as likely 0 as 1."""
    words, cursor, _, _ = coder
    answers = np.empty(count, dtype=np.bool_)
    for i in range(count):
        answers[i] = _take(words, cursor, _EVEN)
    return answers


@plain
def _take_run(words, cursor, weight, order, first, last, answers):
    """Take the bits of a run to where they belong; return how many are 1."""
    state, left = cursor[0], np.int64(cursor[1])
    one, zero = np.uint64(weight), np.uint64(_WEIGHT_TOTAL - weight)
    ones = 0
    for place in range(first, last):
        if state >> _WORD_BITS == 0 and left:
            left -= 1
            state = (state << _WORD_BITS) | np.uint64(words[left])
        part = state & _WEIGHT_MASK
        bit = part >= zero
        share, passed = (one, zero) if bit else (zero, np.uint64(0))
        state = (state >> _WEIGHT_BITS) * share + part - passed
        answers[order[place]] = bit
        ones += bit
    cursor[0], cursor[1] = state, np.uint64(left)
    return ones


@plain
def _take(words, cursor, weight):
    """Return the next bit."""
    state, left = cursor[0], np.int64(cursor[1])
    one, zero = np.uint64(weight), np.uint64(_WEIGHT_TOTAL - weight)
    if state >> _WORD_BITS == 0 and left:
        left -= 1
        state = (state << _WORD_BITS) | np.uint64(words[left])
    part = state & _WEIGHT_MASK
    bit = part >= zero
    state = (state >> _WEIGHT_BITS) * (one if bit else zero) + part
    cursor[0], cursor[1] = state - zero if bit else state, np.uint64(left)
    return bit


@plain
def _learn(counts, context, zeros, ones, count_limit):
    zeros, ones = counts[0, context] + zeros, counts[1, context] + ones
    while zeros + ones > count_limit:
        zeros, ones = zeros >> 1, ones >> 1
    counts[0, context], counts[1, context] = zeros, ones
