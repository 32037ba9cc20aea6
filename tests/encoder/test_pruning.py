import numpy as np
import pytest
import torch

from quarc_ref.encoder.canonical import start_from_points
from quarc_ref.encoder.config import CanonicalSettings
from quarc_ref.encoder.pruning import measure_presence, prune_unmissed
from quarc_ref.encoder.trainable import Trainer
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


def test_presence_is_the_change_of_the_pictures_without_the_gaussian(studio, attributes):
    full = _render(studio, attributes)
    every = torch.arange(attributes.opacities.numel())
    changes = [
        float((_render(studio, attributes.rows(every != one)) - full).square().mean())
        for one in range(0, every.numel(), 9)
    ]
    generator = _generator()

    draws = [measure_presence(studio, attributes, generator)[0] for _ in range(200)]

    estimate = torch.stack(draws).mean(dim=0)[::9].numpy()
    # 400 probes in each of 3 views: a deviation of at most sqrt(2 / 400) of a view's share.
    np.testing.assert_allclose(estimate, changes, rtol=0.25, atol=1e-9)


def test_what_the_pictures_miss_is_their_mean_squared_error(studio, attributes):
    truth = torch.stack([studio.truth(view, 0) for view in range(len(studio.views.cameras))])

    _, error = measure_presence(studio, attributes, _generator())

    assert error == pytest.approx(float((_render(studio, attributes) - truth).square().mean()))


def test_gaussians_that_no_view_sees_go_and_the_others_stay(studio, attributes):
    hidden = attributes.rows(torch.arange(5))
    hidden.means[:] = torch.tensor([0.0, 0.0, -1e3])
    trainer = Trainer(attributes.joined(hidden), (0.1,) * 6)
    presence, _ = measure_presence(studio, attributes, _generator())
    seen = int((presence > 0).sum())

    prune_unmissed(trainer, studio, 1e-9, _generator())

    assert seen - 1 <= trainer.count <= seen
    assert trainer.attributes.means[:, 2].min() > -1e3


def test_a_higher_price_keeps_fewer_and_never_none(studio, attributes):
    counts = []
    for price in (0.0, 0.02, 0.1, 1e9):
        trainer = Trainer(attributes, (0.1,) * 6)
        prune_unmissed(trainer, studio, price, _generator())
        counts.append(trainer.count)

    assert counts[0] == attributes.opacities.numel()
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > counts[1] > counts[2] > counts[3] == 1
