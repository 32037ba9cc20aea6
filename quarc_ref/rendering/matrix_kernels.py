"""Kernels for 3x3 matrices, which are given as nine numbers in row-major order."""

from quarc_ref.rendering.compiled import inlined_kernel


@inlined_kernel
def multiply_vector(matrix, x, y, z):
    """Return the product of a matrix and a vector."""
    return (
        matrix[0] * x + matrix[1] * y + matrix[2] * z,
        matrix[3] * x + matrix[4] * y + matrix[5] * z,
        matrix[6] * x + matrix[7] * y + matrix[8] * z,
    )


@inlined_kernel
def multiply_vector_transposed(matrix, x, y, z):
    """Return the product of the transpose of a matrix and a vector."""
    return (
        matrix[0] * x + matrix[3] * y + matrix[6] * z,
        matrix[1] * x + matrix[4] * y + matrix[7] * z,
        matrix[2] * x + matrix[5] * y + matrix[8] * z,
    )


@inlined_kernel
def multiply_matrices(a, b):
    """Return the product of the matrices a and b."""
    return (
        *multiply_vector_transposed(b, a[0], a[1], a[2]),
        *multiply_vector_transposed(b, a[3], a[4], a[5]),
        *multiply_vector_transposed(b, a[6], a[7], a[8]),
    )


@inlined_kernel
def multiply_matrices_transposed(a, b):
    """Return the product of the transpose of matrix a and the matrix b."""
    return (
        *multiply_vector_transposed(b, a[0], a[3], a[6]),
        *multiply_vector_transposed(b, a[1], a[4], a[7]),
        *multiply_vector_transposed(b, a[2], a[5], a[8]),
    )
