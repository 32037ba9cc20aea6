"""Compiler options of the kernels of the synthetic scene.

Only kernels with `entrance` are cached on disk, including the kernels that they call.
"""

from quarc_ref.compiled import keep, numba

plain = numba.njit(error_model="numpy", fastmath=True)
inlined = numba.njit(error_model="numpy", fastmath=True, forceinline=True)
entrance = keep(fastmath=True, nogil=True)
