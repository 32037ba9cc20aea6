"""Kernels for 3x3 matrices as nine numbers in row-major order, which the compiler can unroll."""

from quarc_ref.rendering.compiled import plain


@plain
def times(m, x, y, z):
    """Return the matrix times a vector."""
    return (
        m[0] * x + m[1] * y + m[2] * z,
        m[3] * x + m[4] * y + m[5] * z,
        m[6] * x + m[7] * y + m[8] * z,
    )


@plain
def transposed_times(m, x, y, z):
    """Return the transposed matrix times a vector."""
    return (
        m[0] * x + m[3] * y + m[6] * z,
        m[1] * x + m[4] * y + m[7] * z,
        m[2] * x + m[5] * y + m[8] * z,
    )


@plain
def product(a, b):
    """Return a times b."""
    return (
        *transposed_times(b, a[0], a[1], a[2]),
        *transposed_times(b, a[3], a[4], a[5]),
        *transposed_times(b, a[6], a[7], a[8]),
    )


@plain
def transposed_product(a, b):
    """Return the transposed a times b."""
    return (
        *transposed_times(b, a[0], a[3], a[6]),
        *transposed_times(b, a[1], a[4], a[7]),
        *transposed_times(b, a[2], a[5], a[8]),
    )
