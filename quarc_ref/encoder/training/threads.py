"""Fixes the number of torch threads, on which torch's results depend.

torch splits long arrays into one piece per thread. It sums by pieces, and uses different
instructions at the end of a piece, so the last bits of results depend on the number of
threads. Training therefore uses one torch thread on every machine. Most of the work is
done by the renderer's kernels, which use all CPU cores and whose results do not depend on
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
    # numba sets OpenMP's number of threads, and thus torch's, when it starts its threads
    start_threads()
    before = torch.get_num_threads()
    torch.set_num_threads(_THREADS)
    try:
        yield
    finally:
        torch.set_num_threads(before)
