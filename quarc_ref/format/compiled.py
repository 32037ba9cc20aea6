"""How the kernels of `format` and `decoder` are compiled.

Kernels hold no lock of the interpreter, so that threads may run several at a
time. Only what Python calls keeps its machine code on disk, with all that it
calls in turn: after a change to a kernel that others call, touch their modules.
"""

import numba

plain = numba.njit(error_model="numpy")
entrance = numba.njit(error_model="numpy", nogil=True, cache=True)
