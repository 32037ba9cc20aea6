"""Rotations turned by residuals (SPEC 7.3, 7.5), compiled; `rotation` holds the plain twin.

Loops take a block at a time and do not branch, so that they become vector
instructions: quotients and roots are guessed in floating point, and integers
correct the guess, whatever its last bit. Numbers that fit 32 bits are kept in
them: two of these, not of 64, are multiplied side by side, and become floats.
"""

import numpy as np

from quarc_ref.format.compiled import plain

BLOCK = 256
ONE = 1 << 22
_FRACTION_BITS = 22
_SUM_GUARD = 20
_PRODUCT_GUARD = 8
_HALF_BITS = 23  # of a sum of squares, which is below 2^46


@plain
def make_spare():
    """Return room for the norms of a block of vectors, and for the reciprocal of each."""
    return np.empty(BLOCK, dtype=np.int32), np.empty(BLOCK, dtype=np.float64)


@plain
def turn_block(rotations, residuals, spare):
    """Turn rotations by sums of residuals.

    Args:
        rotations: int32 `[4, BLOCK]` wxyz, Q22; turned in place.
        residuals: int32 `[4, BLOCK]` wxyz, sums in rotation steps, below 2^10 in
            magnitude; written over.
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
        a, b, c, d = np.int64(w[i]), np.int64(x[i]), np.int64(y[i]), np.int64(z[i])
        squared = a * a + b * b + c * c + d * d
        degenerate |= squared == 0
        norm = _norm(max(squared, 1), guard)
        norms[i] = norm
        shares[i] = np.float64(1 << (_FRACTION_BITS + guard)) / np.float64(norm)
    for row in range(4):
        part = vectors[row]
        for i in range(BLOCK):
            number = np.int64(part[i])
            guess = np.int32(np.float64(np.int32(abs(number))) * shares[i])
            part[i] = _divide_round(number << (_FRACTION_BITS + guard), norms[i], guess)
    return degenerate != 0


@plain
def _multiply(rotations, residuals):
    """Multiply quaternions Q22, the residuals on the right; rounded to Q22."""
    ws, xs, ys, zs = rotations[0], rotations[1], rotations[2], rotations[3]
    by_w, by_x, by_y, by_z = residuals[0], residuals[1], residuals[2], residuals[3]
    for i in range(BLOCK):
        w, x, y, z = np.int64(ws[i]), np.int64(xs[i]), np.int64(ys[i]), np.int64(zs[i])
        a, b, c, d = np.int64(by_w[i]), np.int64(by_x[i]), np.int64(by_y[i]), np.int64(by_z[i])
        ws[i] = _to_unit(w * a - x * b - y * c - z * d)
        xs[i] = _to_unit(w * b + x * a + y * d - z * c)
        ys[i] = _to_unit(w * c - x * d + y * a + z * b)
        zs[i] = _to_unit(w * d + x * c - y * b + z * a)


@plain
def _to_unit(product):
    """Divide by 2^22, halves away from zero."""
    magnitude = (abs(product) + (1 << (_FRACTION_BITS - 1))) >> _FRACTION_BITS
    return magnitude if product >= 0 else -magnitude


@plain
def _divide_round(numerator, denominator, guess):
    """Divide, halves away from zero; the guess is the answer's magnitude, or 1 less."""
    doubled, divisor = 2 * abs(numerator) + denominator, 2 * np.int64(denominator)
    left = doubled - 2 * (np.int64(guess) * np.int64(denominator))
    quotient = np.int64(guess) + np.int64(left >= divisor)
    return quotient if numerator >= 0 else -quotient


@plain
def _norm(squared, guard):
    """Return the root of a sum of squares, rounded down, with guard bits."""
    high = np.float64(np.int32(np.uint64(squared) >> np.uint64(_HALF_BITS)))
    low = np.float64(np.int32(squared & ((1 << _HALF_BITS) - 1)))
    root = np.int32(np.sqrt(high * (1 << _HALF_BITS) + low) * (1 << guard))
    value, square = squared << (2 * guard), np.int64(root) * np.int64(root)
    return np.int32(root - (square > value) + (square + 2 * np.int64(root) < value))
