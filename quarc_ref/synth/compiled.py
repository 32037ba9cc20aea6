"""Compiler options of the kernels of the synthetic scene.

Only kernels decorated with `entry_kernel` are cached on disk, together with the kernels that
they call.
"""

from quarc_ref.compiled import cached_njit, numba

kernel = numba.njit(error_model="numpy", fastmath=True)
inlined_kernel = numba.njit(error_model="numpy", fastmath=True, forceinline=True)
entry_kernel = cached_njit(fastmath=True, nogil=True)
