import math
from dataclasses import replace

import torch

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.training import density
from quarc_ref.encoder.training.density import ScreenStatistics, densify, sample_offsets, split
from quarc_ref.encoder.training.trainable import Attributes, Trainer
from quarc_ref.rendering.rasterizer import Rendering
from tests.rendering.scenes import make_camera

_EXTENT = 1.0


def _make_attributes(scales: list[float], opacities: list[float] | None = None) -> Attributes:
    count = len(scales)
    return Attributes(
        torch.arange(count * 3, dtype=torch.float32).reshape(count, 3),
        torch.tensor([[1.0, 0, 0, 0]]).repeat(count, 1),
        torch.log(torch.tensor(scales))[:, None].repeat(1, 3),
        torch.tensor(opacities or [0.0] * count),
        torch.zeros(count, 1, 3),
        torch.zeros(count, 3, 3),
    )


def _make_statistics(gradients: list[float]) -> ScreenStatistics:
    statistics = ScreenStatistics(len(gradients), torch.device("cpu"))
    radii = torch.ones(len(gradients))
    blank = torch.zeros(1, 1, 3)
    camera = make_camera(2, 2)
    pixels = torch.tensor([[gradient, 0.0] for gradient in gradients])
    statistics.add(pixels, Rendering(blank, blank[..., 0], pixels, radii), camera)
    return statistics


def _densify(attributes, gradients, scale_threshold=0.1, **settings) -> Attributes:
    trainer = Trainer(attributes, (0.1,) * 6)
    densify_settings = CanonicalSettings(
        densify_grad_threshold=0.5, densify_scale_threshold=scale_threshold, **settings
    )
    generator = torch.Generator().manual_seed(0)
    densify(trainer, _make_statistics(gradients), densify_settings, _EXTENT, generator)
    return trainer.attributes.detached()


def test_a_small_gaussian_with_a_large_gradient_is_cloned():
    densified = _densify(_make_attributes([0.01, 0.01]), [1.0, 0.1])

    assert densified.means.tolist() == [[0, 1, 2], [3, 4, 5], [0, 1, 2]]


def test_a_large_gaussian_with_a_large_gradient_is_split_into_two_smaller_ones():
    densified = _densify(_make_attributes([0.5, 0.5]), [1.0, 0.1])

    assert densified.means.shape[0] == 3
    assert densified.means[0].tolist() == [3, 4, 5]
    assert torch.allclose(densified.log_scales[1:], torch.full((2, 3), math.log(0.5 / 1.6)))


def test_of_two_gaussians_with_large_gradients_only_the_larger_is_split():
    attributes = _make_attributes([0.01, 0.01])
    attributes.log_scales[1, 2] = math.log(0.5)  # large along one axis

    densified = _densify(attributes, [1.0, 1.0])

    assert densified.means[:2].tolist() == [[0, 1, 2], [0, 1, 2]]
    assert torch.allclose(densified.log_scales[:2], torch.tensor(math.log(0.01)))
    assert torch.allclose(densified.log_scales[2:, 2], torch.tensor(math.log(0.5 / 1.6)))


def test_with_a_scale_threshold_of_0_every_gaussian_is_split():
    densified = _densify(_make_attributes([0.01, 0.01]), [1.0, 1.0], scale_threshold=0.0)

    assert torch.allclose(densified.log_scales, torch.full((4, 3), math.log(0.01 / 1.6)))


def test_a_transparent_gaussian_is_pruned():
    densified = _densify(_make_attributes([0.01, 0.01], [0.0, -9.0]), [0.0, 0.0])

    assert densified.means.tolist() == [[0, 1, 2]]


def test_densification_respects_the_maximum_number_of_gaussians():
    densified = _densify(_make_attributes([0.01] * 4), [1.0, 4.0, 3.0, 2.0], max_gaussians=6)

    assert densified.means[4:].tolist() == [[3, 4, 5], [6, 7, 8]]


def test_gradients_are_means_over_the_views_that_see_a_gaussian():
    statistics = ScreenStatistics(2, torch.device("cpu"))
    camera, blank = make_camera(4, 2), torch.zeros(1, 1, 3)
    for radii in ([3.0, 0.0], [5.0, 1.0]):
        gradient = torch.tensor([[1.0, 0.0], [0.0, 1.0]])
        rendering = Rendering(blank, blank[..., 0], gradient, torch.tensor(radii))
        statistics.add(gradient, rendering, camera)

    assert statistics.mean_gradients().tolist() == [2.0, 1.0]
    assert statistics.largest_radii().tolist() == [5.0, 1.0]


def test_adam_continues_with_the_remaining_rows():
    def take_steps(trainer, count):
        for _ in range(count):
            means = trainer.attributes.means
            trainer.step((means**2).sum() + 0 * trainer.attributes.sh_dc.sum(), means)

    reference_trainer, changed_trainer = (
        Trainer(_make_attributes([1.0] * 3), (0.1,) * 6) for _ in range(2)
    )
    take_steps(reference_trainer, 3)
    take_steps(changed_trainer, 3)
    changed_trainer.replace_rows(torch.tensor([True, False, True]), _make_attributes([2.0]))
    take_steps(reference_trainer, 2)
    take_steps(changed_trainer, 2)

    densified = changed_trainer.attributes.means
    assert torch.equal(densified[:2], reference_trainer.attributes.means[[0, 2]])
    assert changed_trainer.count == 3


def test_parts_of_a_split_gaussian_are_sampled_from_it():
    elongated = _make_attributes([1.0] * 4000)
    elongated = Attributes(
        0 * elongated.means,
        torch.tensor([[1.0, 0, 0, 1.0]]).repeat(4000, 1),
        torch.log(torch.tensor([[1.0, 0.1, 0.01]])).repeat(4000, 1),
        *elongated.tensors()[3:],
    )

    offsets = sample_offsets(elongated, 2.0, torch.Generator().manual_seed(0))
    parts = split(elongated, torch.Generator().manual_seed(0))

    # The rotation is 90 degrees around z, so the largest deviation is along y.
    assert torch.allclose(offsets.std(dim=0), torch.tensor([0.2, 2.0, 0.02]), rtol=0.05)
    assert parts.means.shape == (8000, 3)


def _with_and_without_kernels(monkeypatch, compute):
    """Return the results of a function with kernels, and with torch operations."""
    results = []
    for has_kernels in (True, False):
        monkeypatch.setattr(density, "has_kernels", lambda _, answer=has_kernels: answer)
        results.append(compute())
    return results


def test_kernels_sample_the_same_offsets_as_torch(monkeypatch):
    def sample():
        generator = torch.Generator().manual_seed(0)
        attributes = _make_attributes([0.5] * 300)
        log_scales = torch.randn(300, 3, generator=generator)
        rotations = torch.randn(300, 4, generator=generator)  # not normalized
        attributes = replace(attributes, rotations=rotations, log_scales=log_scales)
        return sample_offsets(attributes, 2.0, generator)

    with_kernels, without_kernels = _with_and_without_kernels(monkeypatch, sample)
    assert torch.allclose(with_kernels, without_kernels, rtol=1e-4, atol=1e-5)


def test_kernels_accumulate_the_same_statistics_as_torch(monkeypatch):
    def accumulate():
        generator = torch.Generator().manual_seed(0)
        statistics = ScreenStatistics(300, torch.device("cpu"))
        camera, blank = make_camera(40, 20), torch.zeros(1, 1, 3)
        for _ in range(3):
            gradient = torch.randn(300, 2, generator=generator)
            radii = torch.randn(300, generator=generator).clamp(min=0)
            statistics.add(gradient, Rendering(blank, blank[..., 0], gradient, radii), camera)
        return statistics.state()

    with_kernels, without_kernels = _with_and_without_kernels(monkeypatch, accumulate)
    assert 0 < int((without_kernels["views"] == 0).sum()) < 100
    for name, values in without_kernels.items():
        assert torch.allclose(with_kernels[name], values, rtol=1e-6), name
