import math

import numpy as np
import pytest
import torch

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.training.canonical_objective import CanonicalObjective, Pruning
from quarc_ref.encoder.training.initialization import initialize_from_points
from quarc_ref.encoder.training.pruning import measure_contributions, prune_by_contribution
from quarc_ref.encoder.training.trainable import Trainer
from quarc_ref.format.records import StreamHeader
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
        prune_by_contribution(trainer, context, Pruning(0.5, max_share=0.5), _generator())
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

    prune_by_contribution(trainer, context, Pruning(1e-9, max_share=0.5), _generator())

    assert visible_count - 1 <= trainer.count <= visible_count
    assert trainer.attributes.means[:, 2].min() > -1e3


@pytest.mark.parametrize("max_share", [0.5, 0.75])
def test_a_higher_threshold_keeps_fewer_and_at_least_a_share(context, attributes, max_share):
    visible_count = _count_visible(context, attributes)

    counts = [
        _count_after(context, attributes, Pruning(threshold, max_share))
        for threshold in (0.0, 0.005, 0.02, 1e9, None)
    ]

    assert counts[0] == visible_count
    assert counts[0] > counts[1] > counts[2] > counts[3] == counts[4]
    assert counts[4] == math.ceil((1 - max_share) * visible_count)


def test_a_minimum_count_is_kept_if_there_are_as_many(context, attributes):
    visible_count = _count_visible(context, attributes)
    min_count = int(0.9 * visible_count)

    counts = [
        _count_after(context, attributes, Pruning(None, 0.5, count))
        for count in (0, min_count, 10 * visible_count)
    ]

    assert counts == [math.ceil(0.5 * visible_count), min_count, visible_count]


def test_early_prunings_keep_half_and_the_threshold_of_late_ones_rises():
    objective = CanonicalObjective(
        CanonicalSettings(
            iterations=1000, densify_until_iter=800, quantize_from=0.96, max_gaussians=4000,
            prune_rd_lambda=16.0,
        ),
        StreamHeader(),
        rd_factor=0.5,
    )  # fmt: skip

    prunings = {
        step: pruning for step in range(1000) if (pruning := objective.pruning_at(step, 100))
    }

    assert list(prunings) == [200, 400, 600, *range(800, 960, 20)]
    early_prunings, late_prunings = list(prunings.values())[:3], list(prunings.values())[3:]
    assert set(early_prunings) == {Pruning(None, 0.5, 1000)}
    assert objective.pruning_at(400, 3000) == Pruning(None, 0.5, 3000)
    assert [pruning.threshold for pruning in late_prunings] == [*range(1, 9)]
    assert math.prod(1 - pruning.max_share for pruning in late_prunings) == pytest.approx(0.25)


@pytest.mark.parametrize("quantize_from", [0.8, 1.0])
def test_one_late_pruning_happens_even_if_densification_has_no_end(quantize_from):
    objective = CanonicalObjective(
        CanonicalSettings(
            iterations=100,
            densify_until_iter=500,
            quantize_from=quantize_from,
            prune_rd_lambda=3.0,
        ),
        StreamHeader(),
    )

    prunings = [pruning for step in range(100) if (pruning := objective.pruning_at(step, 100))]

    assert [pruning.threshold for pruning in prunings] == [None, None, None, 3.0]
    assert prunings[-1].max_share == 0.75


def test_densification_ends_with_a_late_pruning_even_if_fine_tuning_starts_earlier():
    objective = CanonicalObjective(
        CanonicalSettings(
            iterations=1000, densify_until_iter=990, densify_from_iter=0, densification_interval=10,
            quantize_from=0.8, prune_rd_lambda=3.0,
        ),
        StreamHeader(),
    )  # fmt: skip

    assert objective.pruning_at(800, 100).threshold == 3.0
    assert [step for step in range(1000) if objective.should_densify(step)] == [*range(0, 800, 10)]


def test_a_weight_of_zero_prunes_nothing():
    objective = CanonicalObjective(CanonicalSettings(prune_rd_lambda=0.0), StreamHeader())

    assert not any(objective.pruning_at(step, 100) for step in range(15_000))


def _count_visible(context, attributes):
    return int((measure_contributions(context, attributes, _generator())[0] > 0).sum())


def _count_after(context, attributes, pruning):
    trainer = Trainer(attributes, (0.1,) * 6)
    prune_by_contribution(trainer, context, pruning, _generator())
    return trainer.count
