import pytest
import torch

from quarc_ref.rendering.raster_numba import NumbaRasterizer
from quarc_ref.rendering.raster_torch import TorchRasterizer
from quarc_ref.rendering.rasterizer import Gaussians
from tests.rendering.scenes import activate, compute_weighted_sum, make_camera, make_leaves

_BACKGROUND = torch.tensor([0.2, 0.5, 0.1])
_CAMERA = make_camera(100, 60)


def _make_gaussians(count: int, dtype: torch.dtype) -> Gaussians:
    return activate({name: leaf.detach() for name, leaf in make_leaves(count, dtype).items()})


def _select_rows(gaussians: Gaussians, rows: slice) -> Gaussians:
    return Gaussians(*(tensor[rows] for tensor in gaussians.tensors()))


def _render_with_gradients(render, gaussians: Gaussians):
    """Return a rendering, and the gradients of its weighted sum for means2d and all Gaussians."""
    leaves = [tensor.clone().requires_grad_() for tensor in gaussians.tensors()]
    rendering = render(Gaussians(*leaves))
    return rendering, torch.autograd.grad(
        compute_weighted_sum(rendering), [rendering.means2d, *leaves]
    )


@pytest.mark.parametrize(
    ("rasterizer", "dtype", "count", "added"),
    [
        *((NumbaRasterizer(), torch.float32, *counts) for counts in [(2, 1), (800, 3), (800, 200)]),
        *((TorchRasterizer(), torch.float64, *counts) for counts in [(2, 1), (60, 3), (60, 20)]),
    ],
)
def test_a_picture_on_a_backdrop_equals_that_of_all_gaussians(rasterizer, dtype, count, added):
    all_gaussians, background = _make_gaussians(count, dtype), _BACKGROUND.to(dtype)
    backdrop = rasterizer.render_backdrop(
        _select_rows(all_gaussians, slice(-added)), _CAMERA, background
    )

    expected, expected_gradients = _render_with_gradients(
        lambda gaussians: rasterizer.render(gaussians, _CAMERA, background), all_gaussians
    )
    rendered, rendered_gradients = _render_with_gradients(
        backdrop.render, _select_rows(all_gaussians, slice(-added, None))
    )

    assert torch.equal(expected.image, rendered.image)
    assert torch.equal(expected.alpha, rendered.alpha)
    assert torch.equal(expected.radii[-added:], rendered.radii[-added:])
    for expected_gradient, rendered_gradient in zip(
        expected_gradients, rendered_gradients, strict=True
    ):
        error = (expected_gradient[-added:] - rendered_gradient[-added:]).norm()
        assert float(error) <= 1e-5 * float(expected_gradient[-added:].norm())


def test_of_equal_depths_the_fixed_gaussians_are_in_front():
    rasterizer, fixed = NumbaRasterizer(), _make_gaussians(40, torch.float32)
    brighter = Gaussians(*fixed.tensors()[:4], fixed.sh + 0.3)
    pairs = zip(fixed.tensors(), brighter.tensors(), strict=True)
    together = Gaussians(*(torch.cat(pair) for pair in pairs))

    expected = rasterizer.render(together, _CAMERA, _BACKGROUND)
    rendered = rasterizer.render_backdrop(fixed, _CAMERA, _BACKGROUND).render(brighter)

    assert torch.equal(expected.image, rendered.image)


def test_a_backdrop_equals_the_picture_of_its_gaussians_and_is_not_changed():
    rasterizer, gaussians = NumbaRasterizer(), _make_gaussians(300, torch.float32)
    expected = rasterizer.render(_select_rows(gaussians, slice(200)), _CAMERA, _BACKGROUND)

    backdrop = rasterizer.render_backdrop(_select_rows(gaussians, slice(200)), _CAMERA, _BACKGROUND)
    changed = backdrop.render(_select_rows(gaussians, slice(200, None)))

    assert not torch.equal(changed.image, backdrop.image)
    assert torch.equal(expected.image, backdrop.image)
    assert torch.equal(expected.alpha, backdrop.alpha)


def test_gaussians_outside_the_picture_change_nothing():
    rasterizer, gaussians = NumbaRasterizer(), _make_gaussians(100, torch.float32)
    gaussians.means[90:, 2] = -5

    backdrop = rasterizer.render_backdrop(_select_rows(gaussians, slice(90)), _CAMERA, _BACKGROUND)

    assert torch.equal(
        backdrop.render(_select_rows(gaussians, slice(90, None))).image, backdrop.image
    )
