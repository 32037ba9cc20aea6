"""How the kernels of the synthetic scene are compiled.

Only `entrance` keeps its machine code on disk, with all that it calls.
"""

from quarc_ref.compiled import keep, numba

plain = numba.njit(error_model="numpy", fastmath=True)
inlined = numba.njit(error_model="numpy", fastmath=True, forceinline=True)
entrance = keep(fastmath=True, nogil=True)
