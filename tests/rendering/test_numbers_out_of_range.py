"""Tests numbers out of range: converting such floats to integers depends on the machine."""

import math
import os
import subprocess
import sys
import warnings
from dataclasses import replace

import numpy as np
import pytest
import torch

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.rendering import binning_kernels
from quarc_ref.rendering.pictures import render_picture
from quarc_ref.rendering.raster_numba import NumbaRasterizer
from quarc_ref.rendering.raster_torch import TorchRasterizer
from quarc_ref.rendering.rasterizer import Gaussians
from tests.rendering.scenes import (
    NAMES,
    activate,
    make_camera,
    make_leaves,
    render_with_gradients,
)

_BAND = (0, 4, 5)
_EXTREME_VALUES = [math.nan, math.inf, -math.inf, 1e30, -1e30, 3e38, 1e-38]
_CAMERA = make_camera(70, 50)


def _list_tiles(mean, conic, max_exponent):
    """Return the tiles that a Gaussian intersects, and the pixel rows in each tile."""
    arrays = (
        np.array([mean], dtype=np.float32),
        np.array([conic], dtype=np.float32),
        np.array([max_exponent], dtype=np.float32),
    )
    counts = binning_kernels.count_tiles(*arrays, _BAND)
    starts = np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(counts)])
    tiles, rows = binning_kernels.list_tiles(*arrays, starts, _BAND)
    assert counts.tolist() == [tiles.size]
    return tiles, rows


@pytest.mark.parametrize("value", _EXTREME_VALUES)
@pytest.mark.parametrize("index", range(6))
def test_any_projected_number_gives_valid_tiles_and_rows(value, index):
    numbers = [40.0, 30.0, 0.1, 0.02, 0.1, 5.0]
    numbers[index] = value
    tiles, rows = _list_tiles(numbers[:2], numbers[2:5], numbers[5])

    assert tiles.size <= 20
    assert ((tiles >= 0) & (tiles < 20)).all()
    assert (rows <= binning_kernels.TILE).all()
    if not math.isfinite(value):
        assert tiles.size == 0


_UNCOMPILED = """
import itertools, math
import numpy as np
from quarc_ref.rendering import binning_kernels

np.seterr(all="ignore")
for place, value in itertools.product((0, 1, 2, 4, 5), (math.nan, math.inf, 1e30)):
    numbers = np.array([40, 30, 0.1, 0.02, 0.1, 5, value], dtype=np.float32)
    numbers[place] = numbers[6]
    arrays = numbers[None, :2], numbers[None, 2:5], numbers[5:6]
    counts = binning_kernels.count_tiles(*arrays, (0, 4, 5))
    starts = np.array([0, counts[0]])
    binning_kernels.list_tiles(*arrays, starts, (0, 4, 5))
"""


def test_only_integral_numbers_become_integers():
    """Runs the kernels in Python, which refuses to convert NaN and infinity to integers."""
    result = subprocess.run(
        [sys.executable, "-c", _UNCOMPILED],
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
    )

    assert result.returncode == 0, result.stderr


@pytest.mark.parametrize("distance", [0.0, 1e9, 2e9])
def test_a_gaussian_far_larger_than_the_picture_covers_all_of_it(distance):
    tiles, rows = _list_tiles([distance, -distance], [4e-19, 0, 1e-18], 5.0)

    assert sorted(tiles.tolist()) == list(range(20))
    assert (rows == [0, binning_kernels.TILE]).all()


def _damage_and_activate(leaves, name, value):
    tensors = {key: leaf.detach().clone() for key, leaf in leaves.items()}
    tensors[name].reshape(-1)[5] = value
    return activate(tensors)


@pytest.mark.parametrize("value", _EXTREME_VALUES)
@pytest.mark.parametrize("name", ["means", "quaternions", "log_scales", "sh"])
def test_one_gaussian_out_of_range_does_not_affect_others(name, value):
    leaves, background = make_leaves(30, torch.float32), torch.zeros(3)
    gaussians = _damage_and_activate(leaves, name, value)
    width = leaves[name][0].numel()
    other_rows = [row for row in range(30) if row != 5 // width]
    other_gaussians = Gaussians(*(tensor[other_rows] for tensor in gaussians.tensors()))

    picture = NumbaRasterizer().render(gaussians, _CAMERA, background).image
    expected = NumbaRasterizer().render(other_gaussians, _CAMERA, background).image
    reference = TorchRasterizer().render(gaussians, _CAMERA, background).image

    assert bool(torch.isfinite(picture).all())
    assert bool(torch.isfinite(reference).all())
    if not math.isfinite(value) and (name, value) != ("log_scales", -math.inf):
        assert torch.equal(picture, expected)


def test_a_gaussian_that_is_not_finite_has_no_gradient():
    leaves = make_leaves(30, torch.float32)
    with torch.no_grad():
        leaves["means"][3, 1] = math.nan
        leaves["log_scales"][7] = 40.0

    _, gradients = render_with_gradients(NumbaRasterizer(), leaves, _CAMERA)

    for name in NAMES:
        assert not bool(gradients[name][[3, 7]].any()), name
        assert bool(torch.isfinite(gradients[name]).all()), name


@pytest.mark.parametrize(
    "changes",
    [
        {"fx": 3e38},
        {"translation": (3e38, 0.0, 0.0)},
        {"rotation": (3e38,) * 9, "translation": (3e38, -3e38, 3e38)},
        {"cx": -3e38},
        {"near": 3e38},
        {"near": 1e-40},
    ],
)
def test_a_camera_with_any_numbers_gives_finite_colors(changes):
    camera = replace(_CAMERA, **changes)
    rng = np.random.default_rng(0)
    splats = Splats(
        *(rng.normal(size=(40, size)).astype(np.float32) * 1e6 for size in (3, 4, 3)),
        rng.normal(size=40).astype(np.float32) * 1e4,
        rng.normal(size=(40, 4, 3)).astype(np.float32) * 1e7,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        picture = render_picture(splats, camera)

    assert np.isfinite(picture).all()
