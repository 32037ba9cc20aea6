"""Compiler options of the renderer's kernels.

Only kernels that Python calls are cached on disk. The kernels that they call are not cached
separately, because a cached kernel would not inline other cached kernels.
"""

from quarc_ref.compiled import cached_njit, numba

kernel = numba.njit(error_model="numpy")
inlined_kernel = numba.njit(error_model="numpy", inline="always")
# Allow fused multiply-adds, and ignore the sign of zero.
fused_kernel = numba.njit(error_model="numpy", fastmath={"contract", "nsz"})
# Also sum in any order.
summing_kernel = numba.njit(error_model="numpy", fastmath={"contract", "nsz", "reassoc"})
entry_kernel = cached_njit()
parallel_kernel = cached_njit(parallel=True)


def start_threads() -> None:
    """Start numba's threads if they are not running yet."""
    numba.get_num_threads()
