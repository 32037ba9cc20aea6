import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from quarc_ref.datasets.capture import Points
from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.training.canonical import train_canonical
from quarc_ref.encoder.training.canonical_objective import CanonicalObjective
from quarc_ref.encoder.training.initialization import initialize_from_points
from quarc_ref.encoder.training.learning_rates import learning_rates_at
from quarc_ref.encoder.training.quantize import quantize_gaussians
from quarc_ref.encoder.training.straight_through import position_step
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import LOG_SCALES, StreamHeader
from quarc_ref.rendering.raster_numba import NumbaRasterizer
from tests.encoder.toys import SMALL, make_capture, make_context

_CPU = torch.device("cpu")


def _initialize(points, **settings):
    generator = torch.Generator().manual_seed(0)
    return initialize_from_points(points, CanonicalSettings(**settings), generator, _CPU)


def test_a_gaussian_is_as_large_as_the_distance_to_the_nearest_three_points():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3], [9, 9, 9]], dtype=np.float32)

    attributes = _initialize(Points(points, np.zeros((5, 3), dtype=np.uint8)))

    sizes = {tuple(mean): math.exp(float(scale)) for mean, scale in
             zip(attributes.means.tolist(), attributes.log_scales[:, 0], strict=True)}  # fmt: skip
    assert sizes[(0, 0, 0)] == pytest.approx(math.sqrt((1 + 4 + 9) / 3), rel=1e-5)


def test_a_gaussian_has_the_color_of_its_point():
    colors = np.array([[255, 0, 128]], dtype=np.uint8)

    attributes = _initialize(Points(np.zeros((1, 3), dtype=np.float32), colors))

    color = 0.5 + 0.28209479177387814 * attributes.sh_dc[0, 0]
    assert torch.allclose(color, torch.tensor([1.0, 0.0, 128 / 255]), atol=1e-6)


@pytest.mark.parametrize(
    "settings", [{"initial_gaussians": 20}, {"initial_gaussians": 30, "max_gaussians": 20}]
)
def test_too_many_points_are_subsampled(settings):
    points = make_capture().points

    attributes = _initialize(points, **settings)

    assert attributes.means.shape == (20, 3)
    rows = {tuple(row) for row in points.positions.tolist()}
    assert {tuple(row) for row in attributes.means.tolist()} <= rows


def _measure_errors(context, attributes):
    with torch.no_grad():
        return [
            float(
                (context.render(attributes.activated(), view).image - context.truth(view, 0))
                .square()
                .mean()
            )
            for view in range(len(context.views.cameras))
        ]


def test_training_approaches_the_pictures_and_ends_on_the_grid():
    context, header = make_context(), StreamHeader()
    points = make_capture().points
    initial = initialize_from_points(
        points, SMALL.canonical, torch.Generator().manual_seed(0), _CPU
    )

    trained = train_canonical(context, points, CanonicalObjective(SMALL.canonical, header))

    assert np.mean(_measure_errors(context, trained)) < 0.25 * np.mean(
        _measure_errors(context, initial)
    )
    requantized = trained.quantized(header)
    for tensor, rounded in zip(trained.tensors(), requantized.tensors(), strict=True):
        assert torch.allclose(tensor, rounded, atol=1e-6)
    assert quantize_gaussians(trained, header).count == trained.means.shape[0]


def test_a_scene_that_became_transparent_is_an_encode_error():
    settings = replace(SMALL.canonical, iterations=1, final_prune_opacity=1.0)

    with pytest.raises(EncodeError, match="all Gaussians of the first frame became transparent"):
        train_canonical(
            make_context(), make_capture().points, CanonicalObjective(settings, StreamHeader())
        )


def test_a_scene_that_becomes_transparent_in_training_is_an_encode_error():
    settings = replace(SMALL.canonical, prune_opacity=1.0, max_gaussians=20)

    with pytest.raises(EncodeError, match="all Gaussians of the first frame became transparent"):
        train_canonical(
            make_context(), make_capture().points, CanonicalObjective(settings, StreamHeader())
        )


def test_training_starts_at_half_resolution_and_ends_at_full(monkeypatch):
    widths = []
    render = NumbaRasterizer.render
    monkeypatch.setattr(
        NumbaRasterizer,
        "render",
        lambda self, gaussians, camera, background: (
            widths.append(camera.width) or render(self, gaussians, camera, background)
        ),
    )
    context, points = make_context(), make_capture().points
    settings = replace(SMALL.canonical, half_resolution_until_iter=10)
    initial = initialize_from_points(points, settings, torch.Generator().manual_seed(0), _CPU)

    trained = train_canonical(context, points, CanonicalObjective(settings, StreamHeader()))

    full_width = context.camera(0).width
    assert widths == 10 * [full_width // 2] + (settings.iterations - 10) * [full_width]
    assert np.mean(_measure_errors(context, trained)) < 0.25 * np.mean(
        _measure_errors(context, initial)
    )


def test_the_same_seed_gives_the_same_scene_to_the_bit():
    points, header = make_capture().points, StreamHeader()

    first, second, other_seed = (
        train_canonical(make_context(seed), points, CanonicalObjective(SMALL.canonical, header))
        for seed in (0, 0, 1)
    )

    assert all(torch.equal(a, b) for a, b in zip(first.tensors(), second.tensors(), strict=True))
    assert first.means.shape != other_seed.means.shape or not torch.equal(
        first.means, other_seed.means
    )


def test_without_spherical_harmonics_none_are_trained():
    header = StreamHeader(sh_degree=0)

    trained = train_canonical(
        make_context(), make_capture().points, CanonicalObjective(SMALL.canonical, header)
    )

    assert not trained.sh_rest.any()


def test_opacity_and_scale_penalties_thin_out_haze():
    context = make_context()
    points = make_capture().points
    changed_settings = replace(SMALL.canonical, opacity_reg=1.0, scale_reg=1.0)

    baseline, regularized = (
        train_canonical(context, points, CanonicalObjective(settings, SMALL.stream))
        for settings in (SMALL.canonical, changed_settings)
    )

    assert torch.sigmoid(regularized.opacities).mean() < torch.sigmoid(baseline.opacities).mean()
    assert torch.exp(regularized.log_scales).mean() < torch.exp(baseline.log_scales).mean()


def test_gaussians_without_gradient_fade_away():
    context, points = make_context(), make_capture().points
    changed_settings = replace(SMALL.canonical, opacity_decay=0.02)

    baseline, faded = (
        train_canonical(context, points, CanonicalObjective(settings, SMALL.stream))
        for settings in (SMALL.canonical, changed_settings)
    )

    assert torch.sigmoid(faded.opacities).mean() < torch.sigmoid(baseline.opacities).mean()
    assert np.mean(_measure_errors(context, faded)) < 1.5 * np.mean(
        _measure_errors(context, baseline)
    )


def test_noise_along_the_axes_changes_training_and_ends_before_fine_tuning(monkeypatch):
    rendered_means = []
    render = NumbaRasterizer.render
    monkeypatch.setattr(
        NumbaRasterizer,
        "render",
        lambda self, gaussians, camera, background: (
            rendered_means.append(gaussians.means.detach().clone())
            or render(self, gaussians, camera, background)
        ),
    )
    settings = replace(SMALL.canonical, position_noise=0.0, axis_noise=0.5)

    train_canonical(
        make_context(), make_capture().points, CanonicalObjective(settings, StreamHeader())
    )

    header = StreamHeader()
    step = position_step(header)
    on_grid = [
        bool(torch.allclose(m / step, (m / step).round(), atol=1e-2)) for m in rendered_means
    ]
    fine_tuning_start = math.ceil(settings.quantize_from * settings.iterations)
    assert not any(on_grid[:fine_tuning_start])
    assert all(on_grid[fine_tuning_start:])


def test_gaussians_of_low_contribution_are_pruned_with_a_gaussian_lambda():
    context, points = make_context(), make_capture().points
    changed_settings = replace(SMALL.canonical, prune_rd_lambda=0.2)

    baseline, pruned = (
        train_canonical(context, points, CanonicalObjective(settings, SMALL.stream))
        for settings in (SMALL.canonical, changed_settings)
    )

    assert pruned.means.shape[0] < 0.9 * baseline.means.shape[0]
    assert np.mean(_measure_errors(context, pruned)) < 2 * np.mean(
        _measure_errors(context, baseline)
    )


def test_learning_rates_decay_only_during_fine_tuning():
    settings = replace(SMALL.canonical, lr_end_factor=0.1, quantize_from=0.8)

    shares = [
        learning_rates_at(settings, 1.0, step)[1] / settings.rotation_lr
        for step in (0, 79, 80, 90, 100)
    ]

    assert shares == pytest.approx([1, 1, 1, 0.55, 0.1])


def test_the_learning_rate_of_positions_decays_exponentially_and_is_relative_to_the_extent():
    settings = replace(SMALL.canonical, position_lr=1e-2, position_lr_final=1e-4, quantize_from=1.0)

    rates = [learning_rates_at(settings, 3.0, step)[0] for step in (0, 25, 50, 75)]

    assert rates == pytest.approx([3e-2 * 10 ** -(k / 2) for k in range(4)])


def test_codes_are_smaller_with_a_regularizer():
    context, points = make_context(), make_capture().points
    changed_settings = replace(SMALL.canonical, code_rd_lambda=0.01)

    baseline, regularized = (
        quantize_gaussians(
            train_canonical(context, points, CanonicalObjective(settings, SMALL.stream)),
            SMALL.stream,
        )
        for settings in (SMALL.canonical, changed_settings)
    )

    assert regularized.codes[LOG_SCALES].std() < baseline.codes[LOG_SCALES].std()
    assert np.abs(regularized.rotations[1:]).mean() < np.abs(baseline.rotations[1:]).mean()
