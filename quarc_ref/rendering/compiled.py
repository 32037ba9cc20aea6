"""Compiler options of the renderer's kernels.

Only kernels that Python calls are cached on disk, including the kernels they call: a
cached kernel would not inline other cached kernels.
"""

from quarc_ref.compiled import cached_njit, numba

plain = numba.njit(error_model="numpy")
inlined = numba.njit(error_model="numpy", inline="always")
# Allow fused multiply-adds, and ignore the sign of zero.
fused = numba.njit(error_model="numpy", fastmath={"contract", "nsz"})
entrance = cached_njit()
parallel_entrance = cached_njit(parallel=True)


def start_threads() -> None:
    """Start the threads of kernels, unless they are already running."""
    numba.get_num_threads()
