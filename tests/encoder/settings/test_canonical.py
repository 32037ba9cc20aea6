from dataclasses import replace

import pytest

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.settings.config import limit_gaussians
from quarc_ref.encoder.settings.presets import choose_preset

SETTINGS = CanonicalSettings(initial_gaussians=200, max_gaussians=400, max_gaussians_per_view=51)


@pytest.mark.parametrize(
    ("view_count", "initial_gaussians", "max_gaussians"),
    [(1, 26, 51), (3, 77, 153), (7, 179, 357), (8, 200, 400), (30, 200, 400)],
)
def test_few_views_limit_the_number_of_gaussians(view_count, initial_gaussians, max_gaussians):
    limited = SETTINGS.limit_to_views(view_count)

    assert (limited.initial_gaussians, limited.max_gaussians) == (initial_gaussians, max_gaussians)
    assert replace(limited, initial_gaussians=200, max_gaussians=400) == SETTINGS


def test_a_smaller_initial_number_is_kept():
    assert replace(SETTINGS, initial_gaussians=20).limit_to_views(3).initial_gaussians == 20


def test_the_preset_paper_has_no_such_limit():
    config = choose_preset("paper")

    assert limit_gaussians(config, 1) == config
