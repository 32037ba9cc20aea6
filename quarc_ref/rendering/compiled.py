"""Compiler options of the renderer's kernels.

Only kernels that Python calls are cached on disk. The kernels that they call are not cached
separately, because a cached kernel would not inline other cached kernels.
"""

from quarc_ref.compiled import cached_njit, numba

kernel = numba.njit(error_model="numpy")
inlined_kernel = numba.njit(error_model="numpy", inline="always")
# Allow fused multiply-adds, and ignore the sign of zero. This is only for loops over pixels: in
# other kernels, a process that compiled them and one that loaded them from the cache would fuse
# different products, so their results would differ.
fused_kernel = numba.njit(error_model="numpy", fastmath={"contract", "nsz"})
entry_kernel = cached_njit()
parallel_kernel = cached_njit(parallel=True)


def start_threads() -> None:
    """Start numba's threads if they are not running yet."""
    numba.get_num_threads()
