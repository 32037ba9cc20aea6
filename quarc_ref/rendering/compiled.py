"""How the kernels of the renderer are compiled.

Only kernels that Python calls are cached on disk, including the kernels they call: a cached kernel
that calls another cached one would not inline it.
"""

from quarc_ref.compiled import keep, numba

plain = numba.njit(error_model="numpy")
inlined = numba.njit(error_model="numpy", inline="always")
# Fused multiply-adds, and no care for the sign of zero.
fused = numba.njit(error_model="numpy", fastmath={"contract", "nsz"})
entrance = keep()
parallel_entrance = keep(parallel=True)


def start_threads() -> None:
    """Start the threads that kernels run on; nothing happens if they run."""
    numba.get_num_threads()
