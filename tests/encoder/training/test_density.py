import math

import torch

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.training.density import ScreenStatistics, densify, sample_offsets, split
from quarc_ref.encoder.training.trainable import Attributes, Trainer
from quarc_ref.rendering.rasterizer import Rendering
from tests.rendering.scenes import make_camera

_EXTENT = 1.0


def _attributes(scales: list[float], opacities: list[float] | None = None) -> Attributes:
    count = len(scales)
    return Attributes(
        torch.arange(count * 3, dtype=torch.float32).reshape(count, 3),
        torch.tensor([[1.0, 0, 0, 0]]).repeat(count, 1),
        torch.log(torch.tensor(scales))[:, None].repeat(1, 3),
        torch.tensor(opacities or [0.0] * count),
        torch.zeros(count, 1, 3),
        torch.zeros(count, 3, 3),
    )


def _statistics(gradients: list[float]) -> ScreenStatistics:
    statistics = ScreenStatistics(len(gradients), torch.device("cpu"))
    seen = torch.ones(len(gradients))
    blank = torch.zeros(1, 1, 3)
    camera = make_camera(2, 2)
    pixels = torch.tensor([[gradient, 0.0] for gradient in gradients])
    statistics.add(pixels, Rendering(blank, blank[..., 0], pixels, seen), camera)
    return statistics


def _densified(attributes, gradients, **settings) -> Attributes:
    trainer = Trainer(attributes, (0.1,) * 6)
    chosen = CanonicalSettings(densify_grad_threshold=0.5, densify_scale_threshold=0.1, **settings)
    generator = torch.Generator().manual_seed(0)
    densify(trainer, _statistics(gradients), chosen, _EXTENT, generator)
    return trainer.attributes.detached()


def test_a_small_gaussian_with_a_large_gradient_is_cloned():
    after = _densified(_attributes([0.01, 0.01]), [1.0, 0.1])

    assert after.means.tolist() == [[0, 1, 2], [3, 4, 5], [0, 1, 2]]


def test_a_large_gaussian_with_a_large_gradient_is_split_into_two_smaller_ones():
    after = _densified(_attributes([0.5, 0.5]), [1.0, 0.1])

    assert after.means.shape[0] == 3
    assert after.means[0].tolist() == [3, 4, 5]
    assert torch.allclose(after.log_scales[1:], torch.full((2, 3), math.log(0.5 / 1.6)))


def test_a_transparent_gaussian_is_pruned():
    after = _densified(_attributes([0.01, 0.01], [0.0, -9.0]), [0.0, 0.0])

    assert after.means.tolist() == [[0, 1, 2]]


def test_densification_respects_the_maximum_number_of_gaussians():
    after = _densified(_attributes([0.01] * 4), [1.0, 4.0, 3.0, 2.0], max_gaussians=6)

    assert after.means[4:].tolist() == [[3, 4, 5], [6, 7, 8]]


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
    def steps(trainer, count):
        for _ in range(count):
            means = trainer.attributes.means
            trainer.step((means**2).sum() + 0 * trainer.attributes.sh_dc.sum(), means)

    alone, changed = (Trainer(_attributes([1.0] * 3), (0.1,) * 6) for _ in range(2))
    steps(alone, 3)
    steps(changed, 3)
    changed.replace_rows(torch.tensor([True, False, True]), _attributes([2.0]))
    steps(alone, 2)
    steps(changed, 2)

    after = changed.attributes.means
    assert torch.equal(after[:2], alone.attributes.means[[0, 2]])
    assert changed.count == 3


def test_parts_of_a_split_gaussian_are_sampled_from_it():
    wide = _attributes([1.0] * 4000)
    wide = Attributes(
        0 * wide.means,
        torch.tensor([[1.0, 0, 0, 1.0]]).repeat(4000, 1),
        torch.log(torch.tensor([[1.0, 0.1, 0.01]])).repeat(4000, 1),
        *wide.tensors()[3:],
    )

    offsets = sample_offsets(wide, 2.0, torch.Generator().manual_seed(0))
    parts = split(wide, torch.Generator().manual_seed(0))

    # A quarter turn around z: a Gaussian that is wide along x becomes wide along y.
    assert torch.allclose(offsets.std(dim=0), torch.tensor([0.2, 2.0, 0.02]), rtol=0.05)
    assert parts.means.shape == (8000, 3)
