"""Initializes the Gaussians of frame 0 from the initial points, as in 3DGS."""

import math

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from quarc_ref.datasets.capture import Points
from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.training.trainable import Attributes, to_sh_dc

_INITIAL_OPACITY = 0.1
_NEIGHBOR_COUNT = 3
_MIN_SPACING = 1e-7


def initialize_from_points(
    points: Points, settings: CanonicalSettings, generator: torch.Generator, device: torch.device
) -> Attributes:
    """Create a Gaussian for every initial point.

    If there are more than `settings.initial_gaussians` or `settings.max_gaussians` points, a random
    subset of the smaller size is used. The scale of a Gaussian is the root mean square distance of
    its point to the three nearest other points, as in 3DGS.
    """
    point_count = points.positions.shape[0]
    count = min(point_count, settings.initial_gaussians, settings.max_gaussians)
    indices = torch.randperm(point_count, generator=generator)[:count].numpy()
    positions = points.positions[indices].astype(np.float64)
    log_scales = np.log(_measure_spacing(positions))
    colors = points.colors[indices] / 255
    identity_quaternion = torch.tensor([1.0, 0.0, 0.0, 0.0])
    opacity_logit = math.log(_INITIAL_OPACITY / (1 - _INITIAL_OPACITY))
    tensors = (
        torch.tensor(positions, dtype=torch.float32),
        identity_quaternion.repeat(count, 1),
        torch.tensor(log_scales, dtype=torch.float32)[:, None].repeat(1, 3),
        torch.full((count,), opacity_logit),
        to_sh_dc(torch.tensor(colors)).to(torch.float32)[:, None],
        torch.zeros(count, 3, 3),
    )
    return Attributes(*(tensor.to(device) for tensor in tensors))


def _measure_spacing(positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the `[n]` root mean square distances of points to their three nearest neighbors."""
    neighbor_ranks = list(range(2, 2 + min(_NEIGHBOR_COUNT, positions.shape[0] - 1)))
    if not neighbor_ranks:
        return np.ones(positions.shape[0])
    distances, _ = cKDTree(positions).query(positions, k=neighbor_ranks)
    spacing: NDArray[np.float64] = np.sqrt(np.mean(np.square(distances), axis=1))
    return np.maximum(spacing, _MIN_SPACING)
