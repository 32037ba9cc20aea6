import numpy as np
import pytest
import torch

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.training.canonical import initialize_from_points
from quarc_ref.encoder.training.pruning import measure_contributions, prune_by_contribution
from quarc_ref.encoder.training.trainable import Trainer
from tests.encoder.toys import make_capture, make_context


@pytest.fixture(scope="module")
def context():
    return make_context()


@pytest.fixture
def attributes(context):
    points = make_capture().points
    generator = torch.Generator().manual_seed(0)
    return initialize_from_points(points, CanonicalSettings(), generator, context.device)


def _render(context, attributes):
    with torch.no_grad():
        return torch.stack(
            [
                context.render(attributes.activated(), view).image
                for view in range(len(context.views.cameras))
            ]
        )


def _generator():
    return torch.Generator().manual_seed(1)


def test_presence_is_the_change_of_a_view_without_the_gaussian(context, attributes):
    renderings = _render(context, attributes)
    indices = torch.arange(attributes.opacities.numel())
    sampled = indices[::9]
    changes = torch.stack(
        [
            (_render(context, attributes.rows(indices != index)) - renderings)
            .square()
            .mean(dim=3)
            .sum()
            for index in sampled
        ]
    )
    view_counts = sum(
        context.render(attributes.activated(), view).radii[sampled] > 0
        for view in range(len(context.views.cameras))
    )
    generator = _generator()

    estimates = [measure_contributions(context, attributes, generator)[0] for _ in range(200)]

    estimate = torch.stack(estimates).mean(dim=0)[sampled].numpy()
    # With 400 probes per view, the relative standard deviation is at most sqrt(2 / 400).
    np.testing.assert_allclose(estimate, changes / view_counts.clamp(min=1), rtol=0.25, atol=1e-6)


def test_the_error_around_a_gaussian_is_that_of_its_pixels(context, attributes, monkeypatch):
    pictures = _render(context, attributes)
    pictures[:, :, : context.camera(0).width // 2] += 0.3
    monkeypatch.setattr(type(context), "truth", lambda _, view, __: pictures[view])

    _, error = measure_contributions(context, attributes, _generator())

    share = error / error.max()
    assert float((share > 0.1).float().mean()) > 0.1
    assert float((share < 1e-3).float().mean()) > 0.1


def test_an_error_at_few_gaussians_keeps_all_others(context, attributes, monkeypatch):
    pictures = _render(context, attributes) + 0.1
    monkeypatch.setattr(type(context), "truth", lambda _, view, __: pictures[view])
    counts = []
    for _ in range(2):
        trainer = Trainer(attributes, (0.1,) * 6)
        prune_by_contribution(trainer, context, 0.5, _generator())
        counts.append(trainer.count)
        pictures[:, :4, :4] += 100.0

    assert counts[0] < attributes.opacities.numel()
    assert counts[1] == pytest.approx(counts[0], abs=2)


def test_gaussians_outside_all_views_are_pruned_and_the_others_stay(context, attributes):
    hidden_gaussians = attributes.rows(torch.arange(5))
    hidden_gaussians.means[:] = torch.tensor([0.0, 0.0, -1e3])
    trainer = Trainer(attributes.joined(hidden_gaussians), (0.1,) * 6)
    contributions, _ = measure_contributions(context, attributes, _generator())
    visible_count = int((contributions > 0).sum())

    prune_by_contribution(trainer, context, 1e-9, _generator())

    assert visible_count - 1 <= trainer.count <= visible_count
    assert trainer.attributes.means[:, 2].min() > -1e3


def test_a_higher_lambda_keeps_fewer_and_at_least_half(context, attributes):
    visible_count = int((measure_contributions(context, attributes, _generator())[0] > 0).sum())
    counts = []
    for threshold in (0.0, 0.005, 0.02, 1e9):
        trainer = Trainer(attributes, (0.1,) * 6)
        prune_by_contribution(trainer, context, threshold, _generator())
        counts.append(trainer.count)

    assert counts[0] == visible_count
    assert counts[0] > counts[1] > counts[2] > counts[3] == visible_count // 2 + 1
