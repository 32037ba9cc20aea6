import pytest
import torch

from quarc_ref.rendering.raster_numba import NumbaRasterizer
from quarc_ref.rendering.raster_torch import TorchRasterizer
from quarc_ref.rendering.rasterizer import Gaussians
from tests.rendering.scenes import activate, make_camera, make_leaves, weighted_sum

_BACKGROUND = torch.tensor([0.2, 0.5, 0.1])
_CAMERA = make_camera(100, 60)


def _make_drawn(count: int, dtype: torch.dtype) -> Gaussians:
    return activate({name: leaf.detach() for name, leaf in make_leaves(count, dtype).items()})


def _rows(gaussians: Gaussians, which: slice) -> Gaussians:
    return Gaussians(*(tensor[which] for tensor in gaussians.tensors()))


def _with_gradients(draw, gaussians: Gaussians):
    """A rendering, and the gradients of its weighted sum for means2d and all Gaussians."""
    leaves = [tensor.clone().requires_grad_() for tensor in gaussians.tensors()]
    rendering = draw(Gaussians(*leaves))
    return rendering, torch.autograd.grad(weighted_sum(rendering), [rendering.means2d, *leaves])


@pytest.mark.parametrize(
    ("rasterizer", "dtype"),
    [(NumbaRasterizer(), torch.float32), (TorchRasterizer(), torch.float64)],
)
@pytest.mark.parametrize(("count", "added"), [(60, 10), (800, 3), (800, 200), (2, 1)])
def test_a_picture_on_a_backdrop_equals_that_of_all_gaussians(rasterizer, dtype, count, added):
    drawn, background = _make_drawn(count, dtype), _BACKGROUND.to(dtype)
    backdrop = rasterizer.render_backdrop(_rows(drawn, slice(-added)), _CAMERA, background)

    wanted, gradients = _with_gradients(
        lambda gaussians: rasterizer.render(gaussians, _CAMERA, background), drawn
    )
    got, layered = _with_gradients(backdrop.render, _rows(drawn, slice(-added, None)))

    assert torch.equal(wanted.image, got.image)
    assert torch.equal(wanted.alpha, got.alpha)
    assert torch.equal(wanted.radii[-added:], got.radii[-added:])
    for gradient, other in zip(gradients, layered, strict=True):
        error = (gradient[-added:] - other[-added:]).norm()
        assert float(error) <= 1e-5 * float(gradient[-added:].norm())


def test_of_equal_depths_the_fixed_gaussians_are_in_front():
    rasterizer, drawn = NumbaRasterizer(), _make_drawn(40, torch.float32)
    brighter = Gaussians(*drawn.tensors()[:4], drawn.sh + 0.3)
    pairs = zip(drawn.tensors(), brighter.tensors(), strict=True)
    together = Gaussians(*(torch.cat(pair) for pair in pairs))

    wanted = rasterizer.render(together, _CAMERA, _BACKGROUND)
    got = rasterizer.render_backdrop(drawn, _CAMERA, _BACKGROUND).render(brighter)

    assert torch.equal(wanted.image, got.image)


def test_a_backdrop_equals_the_picture_of_its_gaussians_and_is_not_changed():
    rasterizer, drawn = NumbaRasterizer(), _make_drawn(300, torch.float32)
    alone = rasterizer.render(_rows(drawn, slice(200)), _CAMERA, _BACKGROUND)

    backdrop = rasterizer.render_backdrop(_rows(drawn, slice(200)), _CAMERA, _BACKGROUND)
    changed = backdrop.render(_rows(drawn, slice(200, None)))

    assert not torch.equal(changed.image, backdrop.image)
    assert torch.equal(alone.image, backdrop.image)
    assert torch.equal(alone.alpha, backdrop.alpha)


def test_gaussians_outside_the_picture_change_nothing():
    rasterizer, drawn = NumbaRasterizer(), _make_drawn(100, torch.float32)
    drawn.means[90:, 2] = -5

    backdrop = rasterizer.render_backdrop(_rows(drawn, slice(90)), _CAMERA, _BACKGROUND)

    assert torch.equal(backdrop.render(_rows(drawn, slice(90, None))).image, backdrop.image)
