"""Tests how the ladder benchmark rounds a fit to the steps of a stream, and counts its bytes."""

from dataclasses import replace

import numpy as np
import torch

from ladder.fitting import FitResult
from ladder.rounding import allow_updates, find_updates, round_rung, to_splats
from quarc_ref.encoder.frames.surrogate import rotate
from quarc_ref.encoder.training.straight_through import position_step, translation_step
from quarc_ref.encoder.training.trainable import Attributes
from tests.benchmarks.ladder_toys import (
    begin_toy_frame,
    fit_toy_rung,
    make_attributes,
    make_state,
    move_frame,
)


def test_an_offset_of_whole_steps_is_found_and_decoded_exactly():
    moved_state = move_frame()
    header, attributes = moved_state.scene.header, make_attributes(moved_state)
    rng = np.random.default_rng(5)
    step_counts = rng.integers(-40, 41, (moved_state.scene.count, 22)).astype(np.float32)
    steps_tensor = torch.from_numpy(step_counts)
    expected = Attributes(
        attributes.means + steps_tensor[:, :3] * translation_step(header),
        2 * rotate(attributes.rotations, steps_tensor[:, 3:6] / header.rotation_unity),
        attributes.log_scales + steps_tensor[:, 6:9] * header.log_scale_step,
        attributes.opacities + steps_tensor[:, 9] * header.opacity_step,
        attributes.sh_dc + steps_tensor[:, None, 10:13] * header.sh_dc_step,
        attributes.sh_rest + steps_tensor[:, 13:].reshape(-1, 3, 3) * header.sh_rest_step,
    )
    fit_result = FitResult(expected, torch.arange(moved_state.scene.count))

    updates, sh_rest_residuals = find_updates(moved_state, fit_result)
    decoded, float_splats = round_rung(begin_toy_frame(), fit_result).splats, to_splats(expected)

    assert np.array_equal(updates.residuals, step_counts[updates.gaussians, :13].T)
    assert np.array_equal(sh_rest_residuals, step_counts[:, 13:].T)
    for name in ("positions", "log_scales", "opacities", "sh"):
        assert np.allclose(getattr(decoded, name), getattr(float_splats, name), atol=1e-4), name
    assert np.allclose(
        np.abs((decoded.rotations * float_splats.rotations).sum(axis=1)), 1, atol=1e-5
    )


def test_a_stream_without_updates_equals_one_with_empty_updates():
    state = make_state()
    state_with_updates = allow_updates(state)

    assert state_with_updates.scene.header.updates
    assert set(state_with_updates.required_recency) == {3}
    assert allow_updates(state_with_updates) is state_with_updates


def test_changes_below_half_a_step_cost_almost_nothing():
    start_state, fit_result = fit_toy_rung("still", 0)
    offset = position_step(start_state.scene.header) * 1e-3
    shifted_attributes = replace(fit_result.attributes, means=fit_result.attributes.means + offset)

    rounded = round_rung(start_state, replace(fit_result, attributes=shifted_attributes))

    assert rounded.change_counts["any"] == 0
    assert rounded.coded_bytes <= 8
    assert rounded.rest_bytes == 0


def test_bytes_grow_with_the_changes_and_sh_rest_is_listed_separately():
    start_state, fit_result = fit_toy_rung("carried")
    rounded = round_rung(start_state, fit_result)
    attributes = fit_result.attributes
    changed_attributes = replace(
        attributes, sh_rest=attributes.sh_rest + start_state.scene.header.sh_rest_step
    )
    rounded_with_sh_rest = round_rung(
        start_state, replace(fit_result, attributes=changed_attributes)
    )

    assert rounded.coded_bytes > round_rung(*fit_toy_rung("own")).coded_bytes > 0
    assert (rounded.rest_bytes, rounded_with_sh_rest.coded_bytes) == (0, rounded.coded_bytes)
    assert rounded_with_sh_rest.change_counts["SH rest"] == len(fit_result.survivors)
