"""How the kernels of `format` and `decoder` are compiled.

Kernels hold no lock of the interpreter, so that threads may run several at a
time. Only what Python calls keeps its machine code on disk, with all that it
calls in turn: after a change to a kernel that others call, touch their modules.
"""

from typing import Any

import numba

plain = numba.njit(error_model="numpy")
entrance = numba.njit(error_model="numpy", nogil=True, cache=True)
# The same without the counting of references, which costs an atomic operation at many a call
# and slice, and more where threads count the same arrays. Such kernels make no arrays.
_BARE: Any = {"_nrt": False}
bare = numba.njit(error_model="numpy", **_BARE)
bare_entrance = numba.njit(error_model="numpy", nogil=True, cache=True, **_BARE)
