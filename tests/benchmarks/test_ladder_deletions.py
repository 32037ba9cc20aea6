"""Tests deletions and masks in the fits of the ladder benchmark."""

from dataclasses import replace
from types import SimpleNamespace

import torch

from ladder.deletions import choose_deletions
from ladder.fitting import fit_rung
from ladder.rounding import round_rung
from ladder.rungs import RUNGS
from quarc_ref.encoder.training.context import Observers
from quarc_ref.encoder.training.trainable import from_splats
from quarc_ref.encoder.training.views import TrainingViews
from tests.benchmarks.ladder_toys import (
    QUICK_SETTINGS,
    begin_toy_frame,
    fit_toy_rung,
    make_attributes,
)
from tests.encoder.masked_toys import ColumnMasks, add_masks
from tests.encoder.toys import WIDTH, make_capture, make_context, make_splats


def _make_attributes_with_spot():
    """Return the toy's attributes in frame 0 and a bright Gaussian that no picture shows."""
    attributes = from_splats(make_splats(0), torch.device("cpu"))
    spot = attributes.rows(torch.tensor([len(attributes.means) - 1]))
    spot = replace(spot, means=torch.tensor([[0.0, 0.0, -0.9]]), sh_dc=9 + 0 * spot.sh_dc)
    return attributes.joined(replace(spot, log_scales=spot.log_scales + 1))


def test_only_gaussians_in_the_way_die():
    deletion_mask = choose_deletions(make_context(), _make_attributes_with_spot(), 0, 0.2)

    assert deletion_mask.nonzero().tolist() == [[len(deletion_mask) - 1]]


def test_dying_gaussians_leave_at_half_time_and_the_others_keep_their_opacity(monkeypatch):
    start_state = begin_toy_frame()
    count, progress_calls = start_state.scene.count, []
    deletion_mask = torch.arange(count) < 3
    monkeypatch.setattr("ladder.fitting.choose_deletions", lambda *_: deletion_mask)
    progress = SimpleNamespace(
        advance=lambda *progress_arguments: progress_calls.append(progress_arguments)
    )
    context = replace(make_context(), observers=Observers(progress))

    fit_result = fit_rung(context, start_state, RUNGS["deaths"], 8, QUICK_SETTINGS)
    rounded = round_rung(start_state, fit_result)

    assert fit_result.survivors.tolist() == list(range(3, count))
    assert torch.equal(fit_result.attributes.opacities, make_attributes(start_state).opacities[3:])
    assert rounded.change_counts["deaths"] == 3
    assert rounded.splats.positions.shape[0] == count - 3
    assert [step for _, step, _ in progress_calls] == list(range(1, 9))


def test_gaussians_behind_masks_stay_as_they_are():
    context = make_context()
    views = TrainingViews(add_masks(make_capture(), masks=ColumnMasks(WIDTH // 8)), context.device)
    masked_context, start_state = replace(context, views=views), begin_toy_frame(0)
    start_attributes = make_attributes(start_state)
    is_masked = start_attributes.means[:, 0] > 1

    fit_result = fit_rung(masked_context, start_state, RUNGS["dc"], 8, QUICK_SETTINGS)
    deletion_mask = choose_deletions(masked_context, start_attributes, 0, 0.2)

    assert torch.equal(fit_result.survivors, torch.arange(start_state.scene.count))
    assert not deletion_mask.any()
    for field in ("opacities", "sh_dc"):
        start, end = getattr(start_attributes, field), getattr(fit_result.attributes, field)
        assert torch.equal(end[is_masked], start[is_masked]), field
        assert not torch.equal(end, start), field


def test_with_free_motion_no_gaussian_dies():
    assert len(fit_toy_rung("own")[1].survivors) == begin_toy_frame().scene.count
