"""Passes torch tensors to numba kernels as arrays."""

import torch
from torch import Tensor

from quarc_ref.rendering.pipeline_data import Float32


def has_kernels(tensor: Tensor) -> bool:
    """Return whether numba kernels can process a tensor: whether it is float32 on the CPU."""
    return tensor.device.type == "cpu" and tensor.dtype == torch.float32


def to_array(tensor: Tensor) -> Float32:
    """Return a float32 tensor on the CPU as a contiguous array, which may share its memory."""
    array: Float32 = tensor.detach().contiguous().numpy()
    return array
