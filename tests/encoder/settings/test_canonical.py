from dataclasses import replace

import pytest

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.settings.config import limit_gaussians
from quarc_ref.encoder.settings.presets import choose_preset

SETTINGS = CanonicalSettings(initial_gaussians=2, max_gaussians=400, max_gaussians_from_views=12)


@pytest.mark.parametrize(
    ("view_count", "initial_gaussians", "max_gaussians"),
    [(1, 1, 33), (3, 1, 100), (7, 1, 233), (11, 1, 366), (12, 2, 400), (30, 2, 400)],
)
def test_few_views_reduce_the_number_of_gaussians(view_count, initial_gaussians, max_gaussians):
    limited = SETTINGS.limit_to_views(view_count)

    assert (limited.initial_gaussians, limited.max_gaussians) == (initial_gaussians, max_gaussians)
    assert replace(limited, initial_gaussians=2, max_gaussians=400) == SETTINGS


@pytest.mark.parametrize(("view_count", "size"), [(1, 1), (11, 1), (12, 3), (30, 3)])
def test_few_views_have_no_ensemble(view_count, size):
    settings = CanonicalSettings(ensemble_size=3, ensemble_from_views=12)

    assert settings.limit_to_views(view_count) == replace(settings, ensemble_size=size)


def test_in_the_preset_paper_few_views_change_nothing():
    config = choose_preset("paper")

    assert limit_gaussians(config, 1) == config
