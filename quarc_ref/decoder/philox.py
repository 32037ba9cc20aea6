"""Philox4x32-10, which generates the ranks of the anchor sampler: SPEC 6.2.

Philox is a counter-based generator (Salmon et al., SC 2011): each output is a
function of the key and a counter, so ranks can be computed in any order and without state.
"""

import numpy as np
from numpy.typing import NDArray

from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import PHILOX_ROUNDS

_MULTIPLIERS = (np.uint64(0xD2511F53), np.uint64(0xCD9E8D57))
_KEY_STEPS = (0x9E3779B9, 0xBB67AE85)
_WORD_MASK = 0xFFFFFFFF
_WORD_BITS = np.uint64(32)


def philox(counters: NDArray[np.uint64], seed: int) -> Int64:
    """Return four pseudorandom words for every counter.

    Args:
        counters: `[4, n]` four words of each counter, each below 2^32.
        seed: 64-bit key; the low half is the key's first word.

    Returns:
        `[4, n]` four words for each counter, each below 2^32.
    """
    word_mask = np.uint64(_WORD_MASK)
    c0, c1, c2, c3 = counters.astype(np.uint64)
    k0, k1 = seed & _WORD_MASK, seed >> 32
    for _ in range(PHILOX_ROUNDS):
        product0, product2 = c0 * _MULTIPLIERS[0], c2 * _MULTIPLIERS[1]
        c0, c2 = (
            (product2 >> _WORD_BITS) ^ c1 ^ np.uint64(k0),
            (product0 >> _WORD_BITS) ^ c3 ^ np.uint64(k1),
        )
        c1, c3 = product2 & word_mask, product0 & word_mask
        k0, k1 = (k0 + _KEY_STEPS[0]) & _WORD_MASK, (k1 + _KEY_STEPS[1]) & _WORD_MASK
    return np.stack([c0, c1, c2, c3]).astype(np.int64)
