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
_EVEN_BITS = np.uint64(23)
_EVEN_MASK = np.uint64(_EVEN - 1)


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
    order, used, borders = sort_runs(contexts)
    answers = np.empty(contexts.size, dtype=np.bool_)
    weights, undefined = _weigh(coder, used, counts)
    if undefined >= 0:
        return answers, undefined
    for run in range(used.size):
        first, last = borders[run], borders[run + 1]
        ones = _take_run(coder, weights[run], order, first, last, answers)
        _learn(counts, used[run], last - first - ones, ones, coder[2])
    return answers, -1


@entrance
def read_raw(coder, count):
    """Return bool `[count]` bits that are as likely 0 as 1."""
    words, cursor = coder[0], coder[1]
    state, left = cursor[0], np.int64(cursor[1])
    answers = np.empty(count, dtype=np.bool_)
    for i in range(count):
        if state >> _WORD_BITS == 0 and left:
            left -= 1
            state = (state << _WORD_BITS) | np.uint64(words[left])
        # Half the weight: what is below the bit stays where it is, what is above moves down.
        answers[i] = (state >> _EVEN_BITS) & np.uint64(1)
        state = ((state >> _WEIGHT_BITS) << _EVEN_BITS) | (state & _EVEN_MASK)
    cursor[0], cursor[1] = state, np.uint64(left)
    return answers


@plain
def sort_runs(contexts):
    """Return what elements `[n]` belong to which run, n at least 1.

    Returns:
        int32 `[n]` the elements by context, those of one ascending; int64 `[u]`
        the contexts that there are, ascending; and int64 `[u + 1]` where each begins,
        and the end.
    """
    lengths = np.zeros(contexts.max() + 1, dtype=np.int64)
    for context in contexts:
        lengths[context] += 1
    used = np.flatnonzero(lengths)
    borders = np.zeros(used.size + 1, dtype=np.int64)
    for run in range(used.size):
        borders[run + 1] = borders[run] + lengths[used[run]]
        lengths[used[run]] = borders[run]
    order = np.empty(contexts.size, dtype=np.int32)
    for i in range(contexts.size):
        place = lengths[contexts[i]]
        order[place] = i
        lengths[contexts[i]] = place + 1
    return order, used, borders


@plain
def split_runs(coder, contexts, spans, order, counts):
    """Read a plane whose runs are known, and part each run into those of 0 and those of 1.

    Args:
        coder: Moves on.
        contexts: int64 `[u]` of the runs, ascending.
        spans: int64 `[2, u]` where each begins in the order, and ends.
        order: int32 elements; those of each run are left with those of 0 first, and
            else as they were.
        counts: int64 `[2, c]` zeros and ones that each context has seen; learns.

    Returns:
        int64 `[u]` how many of each run are 0, and a code as of `read_plane`.
    """
    zeros = np.zeros(contexts.size, dtype=np.int64)
    weights, undefined = _weigh(coder, contexts, counts)
    if undefined >= 0:
        return zeros, undefined
    longest = 0
    for run in range(contexts.size):
        longest = max(longest, spans[1, run] - spans[0, run])
    spare = np.empty(longest, dtype=np.int32)
    for run in range(contexts.size):
        first, last = spans[0, run], spans[1, run]
        ones = _split_run(coder, weights[run], order[first:last], spare)
        zeros[run] = last - first - ones
        _learn(counts, contexts[run], zeros[run], ones, coder[2])
    return zeros, -1


@plain
def _weigh(coder, contexts, counts):
    """Return the weights int64 `[u]` of ascending contexts in a plane, and a code as above."""
    words, cursor, _, code_weights = coder
    stated = np.empty(contexts.size, dtype=np.bool_)
    for i in range(contexts.size):
        stated[i] = _take(words, cursor, _STATED)
    weights = np.empty(contexts.size, dtype=np.int64)
    for i in range(contexts.size):
        zeros, ones = counts[0, contexts[i]], counts[1, contexts[i]]
        weights[i] = ((2 * ones + 1) << 24) // (2 * (zeros + ones) + 2)
        if stated[i]:
            code = 0
            for _ in range(_CODE_BITS):
                code = 2 * code + _take(words, cursor, _EVEN)
            if code >= code_weights.size:
                return weights, code
            weights[i] = code_weights[code]
    return weights, -1


@plain
def _take_run(coder, weight, order, first, last, answers):
    """Take the bits of a run to where they belong; return how many are 1."""
    words, cursor = coder[0], coder[1]
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
def _split_run(coder, weight, run, spare):
    """Part a run by its bits; return how many are 1."""
    words, cursor = coder[0], coder[1]
    state, left = cursor[0], np.int64(cursor[1])
    one, zero = np.uint64(weight), np.uint64(_WEIGHT_TOTAL - weight)
    zeros = ones = np.uint64(0)  # as numbers without a sign they are looked up at once
    for i in range(run.size):
        if state >> _WORD_BITS == 0 and left:
            left -= 1
            state = (state << _WORD_BITS) | np.uint64(words[left])
        part = state & _WEIGHT_MASK
        bit = part >= zero
        share, passed = (one, zero) if bit else (zero, np.uint64(0))
        state = (state >> _WEIGHT_BITS) * share + part - passed
        element = run[i]
        run[zeros] = spare[ones] = element
        ones += np.uint64(bit)
        zeros += np.uint64(not bit)
    for i in range(np.int64(ones)):
        run[np.int64(zeros) + i] = spare[i]
    cursor[0], cursor[1] = state, np.uint64(left)
    return np.int64(ones)


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
