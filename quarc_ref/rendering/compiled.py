"""Compiler options of the renderer's kernels.

Only kernels that Python calls are cached on disk, together with the kernels that they call,
because a cached kernel would not inline other cached kernels.
"""

from quarc_ref.compiled import cached_njit, numba

kernel = numba.njit(error_model="numpy")
inlined_kernel = numba.njit(error_model="numpy", inline="always")
# Allow fused multiply-adds, and ignore the sign of zero.
fused_kernel = numba.njit(error_model="numpy", fastmath={"contract", "nsz"})
entry_kernel = cached_njit()
parallel_kernel = cached_njit(parallel=True)


def start_threads() -> None:
    """Start numba's threads, unless the threads are already running."""
    numba.get_num_threads()
