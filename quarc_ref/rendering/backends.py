"""Chooses the rendering backend for a device."""

from importlib.util import find_spec

import torch

from quarc_ref.rendering.raster_gsplat import GsplatRasterizer
from quarc_ref.rendering.raster_numba import NumbaRasterizer
from quarc_ref.rendering.rasterizer import Rasterizer


def choose_device(name: str) -> torch.device:
    """Return a device by name; `auto` means CUDA if a CUDA device and gsplat are available."""
    if name == "auto":
        can_use_cuda = torch.cuda.is_available() and find_spec("gsplat") is not None
        name = "cuda" if can_use_cuda else "cpu"
    return torch.device(name)


def choose_rasterizer(device: torch.device) -> Rasterizer:
    """Return the backend for a device: gsplat on CUDA, numba on the CPU.

    Raises:
        RuntimeError: The device is CUDA, but gsplat is not installed or cannot compile its kernels.
    """
    if device.type == "cuda":
        return GsplatRasterizer()
    return NumbaRasterizer()
