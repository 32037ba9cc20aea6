"""How the kernels of the renderer are compiled.

Only what Python calls keeps its machine code on disk, with all that it calls in
turn: a cached kernel that calls another cached one would not inline it. A
change to a kernel of one module therefore takes effect in another's entrance
once that module is touched, too.
"""

import numba

plain = numba.njit(error_model="numpy")
inlined = numba.njit(error_model="numpy", inline="always")
# Fused multiply-adds, and no care for the sign of zero.
fused = numba.njit(error_model="numpy", fastmath={"contract", "nsz"})
entrance = numba.njit(error_model="numpy", cache=True)
parallel_entrance = numba.njit(error_model="numpy", cache=True, parallel=True)


def start_threads() -> None:
    """Start the threads that kernels run on; nothing happens if they run."""
    numba.get_num_threads()
