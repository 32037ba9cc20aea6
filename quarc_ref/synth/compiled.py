"""Compiler options of the kernels of the synthetic scene.

Only kernels with `entrance` are cached on disk, including the kernels that they call.
"""

from quarc_ref.compiled import cached_njit, numba

plain = numba.njit(error_model="numpy", fastmath=True)
inlined = numba.njit(error_model="numpy", fastmath=True, forceinline=True)
entrance = cached_njit(fastmath=True, nogil=True)
