"""Keeps small constant tensors on a device, so that each one is copied there only once.

A copy from main memory to a GPU waits until the GPU has finished everything before it.
"""

from functools import lru_cache

import torch
from torch import Tensor


@lru_cache(maxsize=1024)
def make_constant(values: tuple[float, ...], device: torch.device, dtype: torch.dtype) -> Tensor:
    """Return a tensor with these values; callers must not change it."""
    return torch.tensor(values, device=device, dtype=dtype)
