"""Rotations turned by residuals (SPEC 7.3, 7.5), compiled; `rotation` holds the plain twin.

Loops take a block at a time and do not branch, so that they become vector
instructions: quotients and roots are guessed in floating point, and integers
correct the guess, whatever its last bit.
"""

import numpy as np

from quarc_ref.format.compiled import plain

BLOCK = 256
ONE = 1 << 22
_FRACTION_BITS = 22
_SUM_GUARD = 20
_PRODUCT_GUARD = 8


@plain
def make_spare():
    """Return room for the norms of a block of vectors, and for the reciprocal of each."""
    return np.empty(BLOCK, dtype=np.int64), np.empty(BLOCK, dtype=np.float64)


@plain
def turn_block(rotations, residuals, spare):
    """Turn rotations by sums of residuals.

    Args:
        rotations: int64 `[4, BLOCK]` wxyz, Q22; turned in place.
        residuals: int64 `[4, BLOCK]` wxyz, sums in rotation steps; written over.
        spare: As of `make_spare`, written.

    Returns:
        Whether a sum or a product has norm zero.
    """
    degenerate = _normalize(residuals, _SUM_GUARD, spare)
    _multiply(rotations, residuals)
    return _normalize(rotations, _PRODUCT_GUARD, spare) or degenerate


@plain
def _normalize(vectors, guard, spare):
    """Make unit quaternions of vectors; tell whether one has norm zero."""
    w, x, y, z = vectors[0], vectors[1], vectors[2], vectors[3]
    norms, shares = spare
    degenerate = 0
    for i in range(BLOCK):
        squared = w[i] * w[i] + x[i] * x[i] + y[i] * y[i] + z[i] * z[i]
        degenerate |= squared == 0
        norms[i] = _isqrt(max(squared, 1) << (2 * guard))
        shares[i] = np.float64(1 << (_FRACTION_BITS + guard)) / np.float64(norms[i])
    for row in range(4):
        part = vectors[row]
        for i in range(BLOCK):
            # Numbers of 32 bits, as these are, become floats and back side by side.
            guess = np.int32(np.float64(np.int32(abs(part[i]))) * shares[i])
            part[i] = _divide_round(part[i] << (_FRACTION_BITS + guard), norms[i], guess)
    return degenerate != 0


@plain
def _multiply(rotations, residuals):
    """Multiply quaternions Q22, the residuals on the right; rounded to Q22."""
    aw, ax, ay, az = rotations[0], rotations[1], rotations[2], rotations[3]
    bw, bx, by, bz = residuals[0], residuals[1], residuals[2], residuals[3]
    for i in range(BLOCK):
        w = aw[i] * bw[i] - ax[i] * bx[i] - ay[i] * by[i] - az[i] * bz[i]
        x = aw[i] * bx[i] + ax[i] * bw[i] + ay[i] * bz[i] - az[i] * by[i]
        y = aw[i] * by[i] - ax[i] * bz[i] + ay[i] * bw[i] + az[i] * bx[i]
        z = aw[i] * bz[i] + ax[i] * by[i] - ay[i] * bx[i] + az[i] * bw[i]
        aw[i], ax[i], ay[i], az[i] = _to_unit(w), _to_unit(x), _to_unit(y), _to_unit(z)


@plain
def _to_unit(product):
    """Divide by 2^22, halves away from zero."""
    magnitude = (abs(product) + (1 << (_FRACTION_BITS - 1))) >> _FRACTION_BITS
    return magnitude if product >= 0 else -magnitude


@plain
def _divide_round(numerator, denominator, guess):
    """Divide, halves away from zero; the guess is the answer's magnitude, or 1 less."""
    doubled, divisor = 2 * abs(numerator) + denominator, 2 * denominator
    left = doubled - np.int64(guess) * divisor
    quotient = np.int64(guess) + np.int64(left >= divisor)
    return quotient if numerator >= 0 else -quotient


@plain
def _isqrt(value):
    root = np.int64(np.sqrt(np.float64(value)))
    root -= np.int64(root * root > value)
    return root + np.int64((root + 1) * (root + 1) <= value)
