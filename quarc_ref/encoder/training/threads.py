"""Fixes the number of torch threads, because the results of torch depend on this number.

torch splits long arrays into one piece per thread, sums each piece separately and uses
different instructions at the end of a piece. The last bits of results therefore depend on
the number of threads, so training uses one torch thread on every machine. Most of the
training time is spent in the renderer's kernels, which use all CPU cores and give the same
results for any number of threads.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import torch

from quarc_ref.rendering.compiled import start_threads

_THREAD_COUNT = 1


@contextmanager
def fixed_threads() -> Iterator[None]:
    """Limit torch to one thread within this context."""
    # When numba starts its threads, it sets the number of OpenMP threads and thus torch's.
    start_threads()
    previous_count = torch.get_num_threads()
    torch.set_num_threads(_THREAD_COUNT)
    try:
        yield
    finally:
        torch.set_num_threads(previous_count)
