import math
import sys
from types import SimpleNamespace

import numba
import pytest
import torch
from torch.utils import cpp_extension

from quarc_ref.rendering import backends, raster_gsplat
from quarc_ref.rendering.backends import choose_device, choose_rasterizer
from quarc_ref.rendering.raster_numba import NumbaRasterizer
from quarc_ref.rendering.raster_torch import TorchRasterizer
from quarc_ref.rendering.rasterizer import convert_gradient_to_ndc
from tests.rendering.scenes import (
    activate,
    compute_weighted_sum,
    make_camera,
    make_leaves,
    render_with_gradients,
)
from tests.rendering.slow_renderer import render_slowly

_SIZES = [(6, 17, 13), (60, 70, 50), (400, 70, 50), (1500, 100, 60)]


def test_the_reference_renders_the_equations():
    leaves, camera = make_leaves(40, torch.float64), make_camera(20, 15)
    gaussians = activate({name: leaf.detach() for name, leaf in leaves.items()})
    background = torch.tensor([0.2, 0.5, 0.1], dtype=torch.float64)

    image = TorchRasterizer().render(gaussians, camera, background).image

    expected = torch.tensor(render_slowly(gaussians, camera, [0.2, 0.5, 0.1]), dtype=torch.float64)
    assert float((image - expected).abs().max()) < 1e-12


def test_the_gradients_of_the_reference_equal_finite_differences():
    leaves, camera = make_leaves(7, torch.float64, seed=2), make_camera(17, 13)
    background = torch.tensor([0.2, 0.5, 0.1], dtype=torch.float64)
    _, gradients = render_with_gradients(TorchRasterizer(), leaves, camera)
    step = 1e-6

    for name, leaf in leaves.items():
        flat = leaf.detach().reshape(-1)
        for index in range(0, flat.numel(), 5):
            sums = []
            for sign in (1, -1):
                moved = flat.clone()
                moved[index] += sign * step
                changed = leaves | {name: moved.reshape(leaf.shape)}
                sums.append(
                    compute_weighted_sum(
                        TorchRasterizer().render(activate(changed), camera, background)
                    )
                )
            slope = float((sums[0] - sums[1]).detach()) / (2 * step)
            assert float(gradients[name].reshape(-1)[index]) == pytest.approx(
                slope, rel=1e-5, abs=1e-5
            )


@pytest.mark.parametrize(("count", "width", "height"), _SIZES)
def test_numba_renders_and_differentiates_like_the_reference(count, width, height):
    camera = make_camera(width, height)

    reference, expected_gradients = render_with_gradients(
        TorchRasterizer(), make_leaves(count, torch.float64), camera
    )
    rendering, gradients = render_with_gradients(
        NumbaRasterizer(), make_leaves(count, torch.float32), camera
    )

    # The tolerance covers float32: plain torch in float32 also has an error of 1e-6.
    assert float((reference.image - rendering.image).detach().abs().max()) < 5e-6
    assert float((reference.alpha - rendering.alpha).detach().abs().max()) < 5e-6
    assert torch.allclose(reference.radii.float(), rendering.radii, rtol=1e-4)
    is_visible = rendering.radii > 0
    expected_gradients["means2d"], gradients["means2d"] = (
        expected_gradients["means2d"][is_visible],
        gradients["means2d"][is_visible],
    )
    for name, gradient in expected_gradients.items():
        error = (gradient - gradients[name]).norm() / gradient.norm()
        assert float(error) < 1e-5, name


@pytest.mark.parametrize("rasterizer", [NumbaRasterizer(), TorchRasterizer()])
def test_sh_of_degree_0_looks_like_degree_1_with_zeros(rasterizer):
    camera = make_camera(70, 50)
    leaves = make_leaves(200, torch.float32)
    sh_dc = leaves["sh"].detach()[:, :1].requires_grad_()
    padded_sh = torch.nn.functional.pad(sh_dc.detach(), (0, 0, 0, 3)).requires_grad_()

    rendering, gradients = render_with_gradients(rasterizer, leaves | {"sh": sh_dc}, camera)
    expected, expected_gradients = render_with_gradients(
        rasterizer, leaves | {"sh": padded_sh}, camera
    )

    assert torch.equal(rendering.image, expected.image)
    expected_gradients["sh"] = expected_gradients["sh"][:, :1]
    for name, gradient in gradients.items():
        assert torch.allclose(gradient, expected_gradients[name], rtol=1e-5, atol=1e-6), name


def test_an_invisible_gaussian_has_no_gradient():
    leaves = make_leaves(50, torch.float32)
    rendering, gradients = render_with_gradients(NumbaRasterizer(), leaves, make_camera(30, 20))
    is_hidden = rendering.radii == 0

    assert bool(is_hidden.any())
    for gradient in gradients.values():
        assert not bool(gradient[is_hidden].any())


def test_gaussians_outside_the_picture_are_visible_if_they_reach_into_it():
    leaves = {name: leaf.detach() for name, leaf in make_leaves(12000, torch.float64, 1).items()}
    leaves["means"][:, :2] *= 4
    leaves["log_scales"][:, 0] = 0.5  # long needles

    def render(rasterizer, dtype):
        gaussians = activate({name: leaf.to(dtype) for name, leaf in leaves.items()})
        background = torch.zeros(3, dtype=dtype)
        return rasterizer.render(gaussians, make_camera(70, 70), background)

    reference = render(TorchRasterizer(), torch.float64)
    rendering = render(NumbaRasterizer(), torch.float32)

    is_visible = reference.radii > 0
    size = torch.tensor([70, 70])
    is_outside = ((reference.means2d < 0) | (reference.means2d > size)).any(dim=1)
    assert int((is_visible & is_outside).sum()) > 500
    assert int((~is_visible).sum()) > 500
    assert torch.equal(rendering.radii > 0, is_visible)


@pytest.mark.parametrize("rasterizer", [NumbaRasterizer(), TorchRasterizer()])
def test_gaussians_nearer_than_the_near_bound_are_not_rendered(rasterizer):
    leaves = make_leaves(1, torch.float32)
    leaves["means"] = torch.tensor([[-0.3, 0.2, 1.0]])
    depth = 0.3 * math.sin(0.3) + math.cos(0.3) + 0.3
    background = torch.zeros(3)

    def measure_alpha(near):
        camera = make_camera(40, 30, near)
        return float(rasterizer.render(activate(leaves), camera, background).alpha.detach().max())

    assert measure_alpha(depth / 0.8 * 0.999) > 0
    assert measure_alpha(depth / 0.8 * 1.001) == 0


def test_the_result_does_not_depend_on_the_number_of_threads():
    camera, results = make_camera(100, 60), []
    for threads in (1, numba.config.NUMBA_NUM_THREADS):
        numba.set_num_threads(threads)
        leaves = make_leaves(800, torch.float32)
        rendering, gradients = render_with_gradients(NumbaRasterizer(), leaves, camera)
        results.append([rendering.image.detach(), *gradients.values()])

    assert all(
        torch.equal(single_thread, all_threads)
        for single_thread, all_threads in zip(*results, strict=True)
    )


def test_a_scene_without_gaussians_is_background():
    leaves = {name: leaf[:0] for name, leaf in make_leaves(3, torch.float32).items()}
    background = torch.tensor([0.1, 0.2, 0.3])

    for rasterizer in (NumbaRasterizer(), TorchRasterizer()):
        rendering = rasterizer.render(activate(leaves), make_camera(20, 10), background)
        assert torch.equal(rendering.image, background.expand(10, 20, 3))
        assert not bool(rendering.alpha.any())


def test_ndc_gradients_are_pixel_gradients_times_half_the_size():
    gradient = torch.tensor([[[1.0, 1.0], [0.0, 2.0]]])

    assert convert_gradient_to_ndc(gradient, make_camera(40, 30)).tolist() == [
        [20.0, 15.0],
        [0.0, 30.0],
    ]


def test_cpus_render_with_numba():
    assert choose_rasterizer(torch.device("cpu")).name == "numba"


@pytest.mark.parametrize(
    ("has_cuda", "has_gsplat", "device"),
    [(True, True, "cuda"), (True, False, "cpu"), (False, True, "cpu")],
)
def test_auto_chooses_cuda_only_if_gsplat_can_render_on_it(
    monkeypatch, has_cuda, has_gsplat, device
):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: has_cuda)
    monkeypatch.setattr(backends, "find_spec", lambda _: object() if has_gsplat else None)

    assert choose_device("auto").type == device
    assert choose_device("cpu").type == "cpu"


def test_without_nvcc_and_compiled_kernels_the_error_says_what_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "gsplat", SimpleNamespace(rasterization=None))
    monkeypatch.setattr(raster_gsplat, "find_spec", lambda _: None)
    monkeypatch.setattr(cpp_extension, "CUDA_HOME", None)
    with pytest.raises(RuntimeError, match=r"nvcc.*--device cpu"):
        choose_rasterizer(torch.device("cuda"))

    monkeypatch.setattr(cpp_extension, "CUDA_HOME", "/usr/local/cuda")
    assert choose_rasterizer(torch.device("cuda")).name == "gsplat"


@pytest.mark.gpu
@pytest.mark.parametrize(("count", "width", "height"), _SIZES)
def test_gsplat_renders_and_differentiates_like_numba(count, width, height):
    if not torch.cuda.is_available():
        pytest.skip("no CUDA device")
    pytest.importorskip("gsplat")
    camera = make_camera(width, height)
    gpu_leaves = {
        name: leaf.detach().cuda().requires_grad_()
        for name, leaf in make_leaves(count, torch.float32).items()
    }

    reference, expected_gradients = render_with_gradients(
        NumbaRasterizer(), make_leaves(count, torch.float32), camera
    )
    rasterizer = choose_rasterizer(torch.device("cuda"))
    rendering, gradients = render_with_gradients(rasterizer, gpu_leaves, camera)

    # CUDA's fast exponential changes a few decisions at alpha 1/255; equal depths may be swapped.
    difference = (reference.image - rendering.image.cpu()).detach().abs()
    assert float(difference.mean()) <= 1e-5
    assert float((difference > 1e-4).float().mean()) <= 1e-3
    assert float(difference.max()) <= 2e-2
    for name, gradient in expected_gradients.items():
        error = (gradient - gradients[name].cpu().reshape(gradient.shape)).norm() / gradient.norm()
        assert float(error) <= 1e-2, name
