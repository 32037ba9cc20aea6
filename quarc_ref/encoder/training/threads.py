"""The number of torch's threads, which reaches its results.

torch cuts long arrays into a piece for each thread. Sums are made piece by
piece, and the numbers at the end of a piece are computed by other instructions
than those before: last bits hang on the number of threads. Training therefore
runs with one on every machine. The kernels of the renderer do not hang on the
number of theirs, take all there are, and do most of the work: a second thread
of torch's gains nothing, and waits for the first wherever other work shares the
processor.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import torch

from quarc_ref.rendering.compiled import start_threads

_THREADS = 1


@contextmanager
def fixed_threads() -> Iterator[None]:
    """Give torch the same number of threads whatever the machine and its environment say."""
    start_threads()  # of numba, which sets OpenMP's number, and so torch's, when it starts its own
    before = torch.get_num_threads()
    torch.set_num_threads(_THREADS)
    try:
        yield
    finally:
        torch.set_num_threads(before)
