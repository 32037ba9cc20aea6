"""How the kernels of the synthetic scene are compiled.

Only `entrance` keeps its machine code on disk, with all that it calls: a change
to a kernel that is called from another module takes effect once the caller's
module is touched, too.
"""

import numba

plain = numba.njit(error_model="numpy", fastmath=True)
inlined = numba.njit(error_model="numpy", fastmath=True, forceinline=True)
entrance = numba.njit(error_model="numpy", fastmath=True, nogil=True, cache=True)
