"""How the kernels of `format` and `decoder` are compiled.

Kernels hold no lock of the interpreter, so that threads may run several at a
time. Only what Python calls keeps its machine code on disk, with all that it
calls in turn: after a change to a kernel that others call, remove `__pycache__`.
"""

import sys
from importlib.util import find_spec
from types import ModuleType
from typing import Any

import numba


def _prepare() -> None:
    """Have numba load what it compiles with, but not all of `scipy.linalg`, which takes as long.

    numba imports SciPy's BLAS to see whether there is one, and once more, by its name, when
    something is compiled that needs it; no kernel here does. So the first time an empty
    module stands in for it.
    """
    blas = "scipy.linalg.cython_blas"
    if blas in sys.modules or find_spec("scipy") is None:
        return
    sys.modules[blas] = ModuleType(blas)
    try:
        import numba.np.arraymath  # noqa: F401
    finally:
        del sys.modules[blas]


_prepare()
plain = numba.njit(error_model="numpy")
entrance = numba.njit(error_model="numpy", nogil=True, cache=True)
# The same without the counting of references, which costs an atomic operation at many a call
# and slice, and more where threads count the same arrays. Such kernels make no arrays. What
# they call is part of them: many arguments passed for little work took a tenth of the binding.
_BARE: Any = {"_nrt": False}
bare = numba.njit(error_model="numpy", forceinline=True, **_BARE)
bare_entrance = numba.njit(error_model="numpy", nogil=True, cache=True, **_BARE)
