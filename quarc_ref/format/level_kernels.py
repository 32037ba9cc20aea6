"""The symbols of a level's anchors (SPEC 8.7), compiled; `motion_planes` holds the plain twin."""

import numpy as np

from quarc_ref.format.compiled import entrance, plain
from quarc_ref.format.plane_kernels import read_plane

_BLOCK = 256
_MOST = 3
_MAGNITUDE_PLANES = 64
_LAST_OWN_PLANE = 2
_AHEAD_BORDERS = (-8, -3, -1, 0, 1, 2, 3, 4, 6, 10)


@entrance
def read_level(coder, parents, previous, above, counts):
    """Read a level.

    Args:
        coder: Of `plane_kernels`; moves on.
        parents: int64 `[a]` of the anchors, a at least 1.
        previous: int16 `[c, a]` the last motion of each anchor's Gaussian.
        above: int64 `[c, p]` what is done at each parent, and int64 `[p]` the
            sum of the magnitudes of its symbols.
        counts: int64 `[2, k]` of the models of moves, not 0 of translation, w
            and rotation, sign and magnitude; learn.

    Returns:
        int64 `[c, a]` symbols, and a probability code that is undefined, -1 if none is.
    """
    symbols = np.zeros(previous.shape, dtype=np.int64)
    contexts = _move_contexts(parents, previous, above)
    moves, undefined = read_plane(coder, contexts, counts[0])
    moving = np.flatnonzero(moves)
    if undefined >= 0 or moving.size == 0:
        return symbols, undefined
    expected = np.empty((previous.shape[0], moving.size), dtype=np.int64)
    for channel in range(previous.shape[0]):
        for j in range(moving.size):
            done = above[0][channel, parents[moving[j]]]
            expected[channel, j] = previous[channel, moving[j]] - done
    there, undefined = _read_not_zero(coder, expected, counts)
    # In the order of their channels, and in a channel of their anchors.
    channels, anchors = np.nonzero(there)
    if undefined >= 0 or channels.size == 0:
        return symbols, undefined
    ahead = np.empty(channels.size, dtype=np.int64)
    for k in range(channels.size):
        ahead[k] = expected[channels[k], anchors[k]]
    signed, undefined = _read_signed(coder, ahead, counts[4], counts[5])
    for k in range(channels.size):
        symbols[channels[k], moving[anchors[k]]] = signed[k]
    return symbols, undefined


@entrance
def hand_down(parents, sums, symbols):
    """Return what a level's anchors hand down to those whose parents they are.

    Args:
        parents: int64 `[a]` of the anchors.
        sums: int64 `[c, p]` what is done at each parent.
        symbols: int64 `[c, a]` of the anchors.

    Returns:
        int64 `[c, a]` what is done at each anchor, and int64 `[a]` the sum of the
        magnitudes of its symbols.
    """
    done, magnitudes = np.empty_like(symbols), np.zeros(parents.size, dtype=np.int64)
    for channel in range(symbols.shape[0]):
        above, own, handed = sums[channel], symbols[channel], done[channel]
        for j in range(parents.size):
            handed[j] = above[np.uint64(parents[j])] + own[j]
            magnitudes[j] += abs(own[j])
    return done, magnitudes


@plain
def _move_contexts(parents, previous, above):
    """Return uint8 `[a]` the contexts of the plane that asks which anchors move."""
    sums, magnitudes = above
    contexts = np.empty(parents.size, dtype=np.uint8)
    expected = np.empty(_BLOCK, dtype=np.int64)
    for first in range(0, parents.size, _BLOCK):
        block = parents[first : first + _BLOCK]
        expected[:] = 0
        for channel in range(previous.shape[0]):
            own, done = previous[channel, first : first + _BLOCK], sums[channel]
            for j in range(block.size):
                expected[j] += abs(own[j] - done[np.uint64(block[j])])
        asked = contexts[first : first + _BLOCK]
        for j in range(block.size):
            far, moved = expected[j], magnitudes[np.uint64(block[j])]
            parent = (moved >= 1) + (moved >= 2) + (moved >= 4)
            asked[j] = 5 * parent + (far >= 1) + (far >= 2) + (far >= 4) + (far >= 8)
    return contexts


@plain
def _read_not_zero(coder, expected, counts):
    """Return bool `[c, n]` which symbols are not 0, and a code that is undefined."""
    there = np.zeros(expected.shape, dtype=np.bool_)
    so_far = np.zeros(expected.shape[1], dtype=np.int64)
    contexts = np.empty(so_far.size, dtype=np.uint8)
    for channel in range(expected.shape[0]):
        for j in range(so_far.size):
            near = min(abs(expected[channel, j]), _MOST)
            contexts[j] = (_MOST + 1) * near + min(so_far[j], _MOST)
        own = counts[1]
        if channel >= 3:
            own = counts[2] if channel == expected.shape[0] - 4 else counts[3]
        there[channel], undefined = read_plane(coder, contexts, own)
        if undefined >= 0:
            return there, undefined
        so_far += there[channel]
    return there, -1


@plain
def _read_signed(coder, ahead, sign_counts, magnitude_counts):
    """Return int64 `[n]` symbols that are not 0, by what was expected, and a code as above."""
    contexts = np.empty(ahead.size, dtype=np.uint8)
    for k in range(ahead.size):
        far = abs(ahead[k])
        near = (far >= 1) + (far >= 2) + (far >= 4) + (far >= 8)
        contexts[k] = 4 + near if ahead[k] > 0 else 4 - near
    negative, undefined = read_plane(coder, contexts, sign_counts)
    magnitudes = np.ones(ahead.size, dtype=np.int64)
    left = np.arange(ahead.size)
    for plane in range(_MAGNITUDE_PLANES):
        if undefined >= 0 or left.size == 0:
            break
        for k in range(left.size):
            toward = -ahead[left[k]] if negative[left[k]] else ahead[left[k]]
            place = 11 * min(plane, _LAST_OWN_PLANE)
            for border in _AHEAD_BORDERS:
                place += toward - plane >= border
            contexts[k] = place
        beyond, undefined = read_plane(coder, contexts[: left.size], magnitude_counts)
        if undefined < 0:
            left = left[beyond]
            for k in left:
                magnitudes[k] += 1
    if undefined < 0:
        for k in range(ahead.size):
            magnitudes[k] = -magnitudes[k] if negative[k] else magnitudes[k]
    return magnitudes, undefined
