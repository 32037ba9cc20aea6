"""Caches the machine code of this package's numba kernels on disk.

The renderer and the synthetic scene use kernels; the decoder uses none. A cache entry contains the
code of a kernel that Python calls, and of all kernels which that kernel calls in turn. All entries
are valid until any kernel of the package changes.
"""

import hashlib
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

__all__ = ["cached_njit", "numba"]


@contextmanager
def _hide_module(module: str) -> Iterator[None]:
    """Make imports of a module fail in a `with` block, unless it has already been imported."""
    if module in sys.modules:
        yield
        return
    sys.modules[module] = None  # type: ignore[assignment] # None means missing
    try:
        yield
    finally:
        del sys.modules[module]


with _hide_module("coverage"):  # importing coverage takes as long as loading a kernel
    import numba
    from numba.core.caching import FunctionCache
    from numba.core.runtime.nrt import rtsys


def _import_without_blas() -> None:
    """Import the modules that most kernels use, without the slow import of `scipy.linalg`.

    numba imports SciPy's BLAS to check that it exists, and imports it again when a kernel uses it.
    No kernel of this package uses BLAS, so an empty module replaces BLAS during the import.
    """
    blas = "scipy.linalg.cython_blas"
    if blas in sys.modules or find_spec("scipy") is None:
        return
    sys.modules[blas] = ModuleType(blas)
    try:
        import numba.np.arraymath  # noqa: F401
    finally:
        del sys.modules[blas]


class _KernelCache(FunctionCache):
    """A cache on disk for the machine code of a kernel.

    In numba, a cache entry is valid until the kernel's own file changes. Here it is valid until any
    kernel file changes, because an entry may contain inlined code of other kernels. In addition,
    numba initializes its compiler before it reads the cache, which takes a fifth of the time to
    the first frame. This class initializes the compiler only if a kernel has to be compiled.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        self._cache_file._source_stamp = (self._cache_file._source_stamp, _hash_kernel_sources())

    def load_overload(self, sig: Any, target_context: Any) -> Any:  # noqa: ANN401
        """Return the cached machine code for a signature, or None if there is none."""
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)  # type: ignore[no-untyped-call]


def cached_njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:  # noqa: ANN401
    """Return a decorator for kernels whose machine code is cached on disk."""
    compile_kernel = numba.njit(error_model="numpy", **options)

    def decorate(function: Callable[..., Any]) -> Any:  # noqa: ANN401
        kernel = compile_kernel(function)
        if hasattr(kernel, "_cache"):  # missing if compilation is disabled
            kernel._cache = _KernelCache(function)
        return kernel

    return decorate


@cache
def _hash_kernel_sources() -> str:
    """Return a key that identifies the package's kernels and their compiler options."""
    folder = Path(__file__).parent
    files = sorted([*folder.rglob("*_kernels.py"), *folder.rglob("compiled.py")])
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()


_import_without_blas()
