from dataclasses import replace

import numpy as np
import pytest
import torch

from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.reconstruct import begin_frame, move
from quarc_ref.decoder.state import State
from quarc_ref.decoder.updates import apply_updates
from quarc_ref.encoder.frame_coder import FrameStart
from quarc_ref.encoder.frames.motion import FittedMotion, fit_motion
from quarc_ref.encoder.frames.updates import TrainedUpdates
from quarc_ref.encoder.settings.frames import UpdateSettings
from quarc_ref.encoder.training.density import ScreenStatistics
from quarc_ref.encoder.training.quantize import quantize_gaussians
from quarc_ref.encoder.training.trainable import from_splats
from quarc_ref.format.constants import RESIDUAL_ROWS
from quarc_ref.format.records import SH_DC, StreamHeader
from tests.encoder.toys import SMALL, make_context, make_splats

_CPU = torch.device("cpu")
_HEADER = StreamHeader(gaussians_per_anchor=4, updates=True)
_MOTION = replace(SMALL.motion, iterations=40)
_UPDATES = UpdateSettings(lr=0.5, rd_lambda=0.0005, quantize_rd_lambda=0.0)


def _make_state(header: StreamHeader = _HEADER) -> State:
    splats = from_splats(make_splats(1), _CPU)  # the scene of frame 1
    return begin_canonical(header, 0, quantize_gaussians(splats, header))


def _add_to_codes(state: State, row: int, gaussians: list[int], offset: int) -> State:
    codes = state.scene.codes.copy()
    codes[row, gaussians] += offset
    return replace(state, scene=replace(state.scene, codes=codes))


def _fit(state: State, settings: UpdateSettings | None = _UPDATES) -> FittedMotion:
    return fit_motion(
        make_context(), FrameStart(state, begin_frame(state, 0), 0), _MOTION, settings
    )


def test_the_scene_in_training_equals_the_decoders():
    frame_start = begin_frame(_make_state(), 0)
    zero_symbols = [
        np.zeros((6, level.owners.size), np.int64) for level in frame_start.required_anchors.levels
    ]
    moved_state = move(frame_start, zero_symbols)
    attributes = from_splats(dequantize(moved_state.scene), _CPU)
    trained = TrainedUpdates(moved_state.scene.count, _HEADER, _UPDATES, _CPU)
    random_residuals = torch.from_numpy(
        np.random.default_rng(0).integers(-20, 20, trained.leaf.shape)
    )
    with torch.no_grad():
        trained.leaf.copy_(
            random_residuals * (torch.arange(len(random_residuals)) % 3 == 0)[:, None]
        )

    updated_attributes = trained.apply_to(attributes).detached()
    decoded = from_splats(
        dequantize(
            apply_updates(
                moved_state,
                replace(
                    trained.quantized_updates(attributes), dies=_no_deaths(trained, attributes)
                ),
            ).scene
        ),
        _CPU,
    )

    unit = torch.nn.functional.normalize(updated_attributes.rotations, dim=1)
    assert torch.allclose(unit, decoded.rotations, atol=1e-5)
    for name in ("means", "log_scales", "opacities", "sh_dc", "sh_rest"):
        assert torch.allclose(
            getattr(updated_attributes, name), getattr(decoded, name), atol=1e-5
        ), name


def _no_deaths(trained, attributes):
    return np.zeros(trained.quantized_updates(attributes).count, dtype=np.bool_)


def test_a_wrong_color_is_corrected():
    wrong_state = _add_to_codes(_make_state(), SH_DC.start, [4, 50], 12)

    updates = _fit(wrong_state).updates

    residuals_by_gaussian = {
        int(i): row for i, row in zip(updates.gaussians, updates.residuals.T, strict=True)
    }
    assert max(residuals_by_gaussian[4][10], residuals_by_gaussian[50][10]) < -2


def test_faded_gaussians_leave():
    state = _make_state()
    attributes = from_splats(dequantize(state.scene), _CPU)
    trained = TrainedUpdates(state.scene.count, _HEADER, _UPDATES, _CPU)
    with torch.no_grad():
        trained.leaf[[7, 70], 9] = torch.tensor([-3.0, -60.0])

    updates = trained.quantized_updates(attributes)

    assert updates.gaussians.tolist() == [7, 70]
    assert updates.dies.tolist() == [False, True]
    assert updates.residuals[9].tolist() == [-3, 0]


def test_statistics_of_deleted_gaussians_are_dropped():
    statistics = ScreenStatistics(3, _CPU)
    statistics.restore({name: torch.tensor([4.0, 5.0, 6.0]) for name in ("sums", "views", "radii")})

    remaining = statistics.without(torch.tensor([False, True, False]))

    assert remaining.largest_radii().tolist() == [4.0, 6.0]
    assert remaining.mean_gradients().tolist() == [1.0, 1.0]


def test_a_higher_lambda_gives_fewer_updates():
    wrong_state = _add_to_codes(_make_state(), SH_DC.start, list(range(40)), 3)

    counts = [
        _fit(wrong_state, replace(_UPDATES, rd_lambda=rd_lambda)).updates.count
        for rd_lambda in (0.0, 0.01, 10.0)
    ]

    assert counts[0] > counts[1] > counts[2]


def test_a_small_residual_is_penalized_beside_a_large_one():
    trained = TrainedUpdates(3, _HEADER, _UPDATES, _CPU)
    with torch.no_grad():
        trained.leaf[1, :2] = torch.tensor([0.2, 20.0])
    trained.penalty().backward()

    assert trained.leaf.grad[1, 0] > 10 * trained.leaf.grad[1, 1] > 0
    assert not trained.leaf.grad[1, 2:].any()


@pytest.mark.parametrize("choose_at", [0.5, 1.0])
def test_residuals_that_do_not_justify_their_bits_are_left_out(choose_at):
    wrong_state = _add_to_codes(_make_state(), SH_DC.start, list(range(40)), 3)

    residual_counts = [
        np.count_nonzero(
            _fit(
                wrong_state, replace(_UPDATES, quantize_rd_lambda=rd_lambda, choose_at=choose_at)
            ).updates.residuals
        )
        for rd_lambda in (0.0, 0.001, 9.0)
    ]

    assert residual_counts[0] > residual_counts[1] > residual_counts[2] == 0


def test_residuals_are_chosen_after_the_first_iteration_at_the_earliest():
    wrong_state = _add_to_codes(_make_state(), SH_DC.start, list(range(40)), 3)

    fitted = _fit(wrong_state, replace(_UPDATES, lr=1.0, quantize_rd_lambda=1e-6, choose_at=1e-9))

    assert fitted.updates.count > 0


def test_only_chosen_residuals_are_trained_further():
    state = _make_state()
    attributes = from_splats(dequantize(state.scene), _CPU)
    trained = TrainedUpdates(
        state.scene.count, _HEADER, replace(_UPDATES, quantize_rd_lambda=1e-6), _CPU
    )
    with torch.no_grad():
        trained.leaf[:40, 0], trained.leaf[:20, 9] = 4.6, 2.6

    # The loss does not depend on opacities.
    trained.choose_residuals(attributes, lambda moved, _: (None, -moved.means[:, 0].sum()), [0])
    with torch.no_grad():
        trained.leaf += 1.0

    updates = trained.quantized_updates(attributes)
    assert updates.gaussians.tolist() == list(range(40))
    assert np.all(updates.residuals[0] == 6)
    assert not updates.residuals[1:].any()


def test_residuals_of_a_deleted_gaussian_are_kept():
    state = _make_state()
    attributes = from_splats(dequantize(state.scene), _CPU)
    trained = TrainedUpdates(
        state.scene.count, _HEADER, replace(_UPDATES, quantize_rd_lambda=9.0), _CPU
    )
    with torch.no_grad():
        trained.leaf[[7, 70], 9] = torch.tensor([-3.0, -60.0])

    trained.choose_residuals(attributes, lambda moved, _: (None, moved.opacities.sum()), [0])

    updates = trained.quantized_updates(attributes)
    assert updates.gaussians.tolist() == [70]
    assert updates.dies.tolist() == [True]


@pytest.mark.parametrize(
    ("updates", "settings"), [(False, _UPDATES), (True, None), (True, replace(_UPDATES, lr=0.0))]
)
def test_without_updates_motion_is_unchanged(updates, settings):
    header_without_updates = replace(_HEADER, updates=False)

    fitted = _fit(_make_state(replace(_HEADER, updates=updates)), settings)

    assert fitted.updates is None
    for symbols, expected_symbols in zip(
        fitted.symbols, _fit(_make_state(header_without_updates), None).symbols, strict=True
    ):
        assert np.array_equal(symbols, expected_symbols)


def test_at_least_one_gaussian_is_left():
    state = _make_state()
    attributes = from_splats(dequantize(state.scene), _CPU)
    trained = TrainedUpdates(state.scene.count, _HEADER, _UPDATES, _CPU)
    with torch.no_grad():
        trained.leaf[:, 9] = -500.0

    updates = trained.quantized_updates(attributes)

    assert updates.count == state.scene.count
    assert int((~updates.dies).sum()) == 1
    assert updates.residuals.shape == (RESIDUAL_ROWS, state.scene.count)
