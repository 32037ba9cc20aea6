from dataclasses import astuple

import numpy as np
import pytest

from quarc_ref.synth.paints import Paint, choose_palette, mix, oklab_to_linear


def test_a_color_without_chroma_is_gray_and_its_lightness_a_cube_root():
    assert oklab_to_linear(0.6, 0.0, 0.3) == pytest.approx((0.216,) * 3, abs=1e-6)


def test_hues_repeat_after_one_turn():
    assert oklab_to_linear(0.6, 0.1, 0.25) == pytest.approx(oklab_to_linear(0.6, 0.1, 1.25))


@pytest.mark.parametrize("seed", range(20))
def test_colors_of_every_seed_are_colors_of_a_surface(seed):
    palette = choose_palette(seed)
    colors = np.vstack([np.atleast_2d(part) for part in astuple(palette)])

    assert ((colors > 0) & (colors < 1)).all()


@pytest.mark.parametrize("seed", range(20))
def test_toys_of_every_seed_differ_in_color(seed):
    toy_colors = np.array(choose_palette(seed).toy_colors) ** (1 / 2.2)
    distances = np.linalg.norm(toy_colors[:, None] - toy_colors, axis=2)[np.triu_indices(6, 1)]

    assert distances.min() > 0.1


def test_a_mix_interpolates_linearly():
    assert mix((0.0, 0.2, 1.0), (1.0, 0.2, 0.0), 0.25) == pytest.approx((0.25, 0.2, 0.75))


def test_a_row_ends_with_the_pattern():
    row = Paint(7, (0.1, 0.2, 0.3), (0.4, 0.5, 0.6), (0.7, 0.8, 0.9), 2.0, 0.5, 0.25, 1.5).as_row()

    np.testing.assert_allclose(row, [*np.arange(1, 10) / 10, 2.0, 0.5, 0.25, 1.5, 7])
