"""Fixes torch's number of threads, on which its results depend.

torch splits long arrays into a piece per thread. It sums piece by piece, and computes the end of
a piece with other instructions than the rest, so the last bits depend on the number of threads.
Training therefore uses one thread on every machine. The kernels of the renderer use all processors
and do most of the work, so a second thread of torch gains nothing. Their results do not depend on
the number of threads.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import torch

from quarc_ref.rendering.compiled import start_threads

_THREADS = 1


@contextmanager
def fixed_threads() -> Iterator[None]:
    """Run with the same number of torch threads on every machine."""
    start_threads()  # of numba, which sets OpenMP's number, and so torch's, when it starts its own
    before = torch.get_num_threads()
    torch.set_num_threads(_THREADS)
    try:
        yield
    finally:
        torch.set_num_threads(before)
