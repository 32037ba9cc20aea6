"""Fixes the settings of torch on which results depend: the number of threads, and TF32.

torch splits long arrays into one piece per thread, sums each piece separately and uses
different instructions at the end of a piece. The last bits of results therefore depend on
the number of threads, so training uses one torch thread on every machine. Most of the
training time is spent in the renderer's kernels, which use all CPU cores and give the same
results for any number of threads.

By default, torch lets cuDNN round the operands of convolutions to TF32, which has 10 bits
after the point. SSIM subtracts squared means from means of squares; with TF32, its gradients
have errors of a tenth.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import torch

from quarc_ref.rendering.compiled import start_threads

_THREAD_COUNT = 1


@contextmanager
def fixed_torch_settings() -> Iterator[None]:
    """Limit torch to one CPU thread, and its convolutions to float32, within this context."""
    # When numba starts its threads, it sets the number of OpenMP threads and thus torch's.
    start_threads()
    previous_count, previous_tf32 = torch.get_num_threads(), torch.backends.cudnn.allow_tf32
    torch.set_num_threads(_THREAD_COUNT)
    torch.backends.cudnn.allow_tf32 = False
    try:
        yield
    finally:
        torch.set_num_threads(previous_count)
        torch.backends.cudnn.allow_tf32 = previous_tf32
