import numpy as np
import pytest
import torch

from quarc_ref.encoder.settings.config import CanonicalSettings
from quarc_ref.encoder.training.canonical import start_from_points
from quarc_ref.encoder.training.pruning import measure_presence, prune_unmissed
from quarc_ref.encoder.training.trainable import Trainer
from tests.encoder.toys import make_capture, make_studio


@pytest.fixture(scope="module")
def studio():
    return make_studio()


@pytest.fixture
def attributes(studio):
    points = make_capture().points
    generator = torch.Generator().manual_seed(0)
    return start_from_points(points, CanonicalSettings(), generator, studio.device)


def _render(studio, attributes):
    with torch.no_grad():
        return torch.stack(
            [
                studio.render(attributes.activated(), view).image
                for view in range(len(studio.views.cameras))
            ]
        )


def _generator():
    return torch.Generator().manual_seed(1)


def test_presence_is_what_a_view_that_sees_the_gaussian_would_miss(studio, attributes):
    full = _render(studio, attributes)
    every = torch.arange(attributes.opacities.numel())
    sampled = every[::9]
    changes = torch.stack(
        [
            (_render(studio, attributes.rows(every != one)) - full).square().mean(dim=3).sum()
            for one in sampled
        ]
    )
    seen = sum(
        studio.render(attributes.activated(), view).radii[sampled] > 0
        for view in range(len(studio.views.cameras))
    )
    generator = _generator()

    draws = [measure_presence(studio, attributes, generator)[0] for _ in range(200)]

    estimate = torch.stack(draws).mean(dim=0)[sampled].numpy()
    # 400 probes in each of 3 views: a deviation of at most sqrt(2 / 400) of a view's share.
    np.testing.assert_allclose(estimate, changes / seen.clamp(min=1), rtol=0.25, atol=1e-6)


def test_the_error_around_a_gaussian_is_that_of_the_pixels_it_shows_in(
    studio, attributes, monkeypatch
):
    pictures = _render(studio, attributes)
    pictures[:, :, : studio.camera(0).width // 2] += 0.3
    monkeypatch.setattr(type(studio), "truth", lambda _, view, __: pictures[view])

    _, error = measure_presence(studio, attributes, _generator())

    share = error / error.max()
    assert float((share > 0.1).float().mean()) > 0.1
    assert float((share < 1e-3).float().mean()) > 0.1


def test_an_error_where_few_gaussians_show_keeps_all_others(studio, attributes, monkeypatch):
    pictures = _render(studio, attributes) + 0.1
    monkeypatch.setattr(type(studio), "truth", lambda _, view, __: pictures[view])
    counts = []
    for _ in range(2):
        trainer = Trainer(attributes, (0.1,) * 6)
        prune_unmissed(trainer, studio, 0.5, _generator())
        counts.append(trainer.count)
        pictures[:, :4, :4] += 100.0

    assert counts[0] < attributes.opacities.numel()
    assert counts[1] == pytest.approx(counts[0], abs=2)


def test_gaussians_that_no_view_sees_go_and_the_others_stay(studio, attributes):
    hidden = attributes.rows(torch.arange(5))
    hidden.means[:] = torch.tensor([0.0, 0.0, -1e3])
    trainer = Trainer(attributes.joined(hidden), (0.1,) * 6)
    presence, _ = measure_presence(studio, attributes, _generator())
    seen = int((presence > 0).sum())

    prune_unmissed(trainer, studio, 1e-9, _generator())

    assert seen - 1 <= trainer.count <= seen
    assert trainer.attributes.means[:, 2].min() > -1e3


def test_a_higher_price_keeps_fewer_and_never_less_than_half(studio, attributes):
    seen = int((measure_presence(studio, attributes, _generator())[0] > 0).sum())
    counts = []
    for price in (0.0, 0.005, 0.02, 1e9):
        trainer = Trainer(attributes, (0.1,) * 6)
        prune_unmissed(trainer, studio, price, _generator())
        counts.append(trainer.count)

    assert counts[0] == seen
    assert counts[0] > counts[1] > counts[2] > counts[3] == seen // 2 + 1
