"""Tests the ladder benchmark on a toy capture with minimal training."""

import json
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from ladder import command
from ladder.deletions import choose_deletions
from ladder.fitting import FitResult, fit_rung
from ladder.judging import Judge
from ladder.rounding import allow_updates, find_updates, round_rung, to_splats
from ladder.rows import Ladder, Task, list_tasks
from ladder.rungs import RUNGS
from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.reconstruct import begin_frame, move
from quarc_ref.encoder.frames.surrogate import rotate
from quarc_ref.encoder.training.canonical import canonical_learning_rates
from quarc_ref.encoder.training.context import Observers
from quarc_ref.encoder.training.quantize import quantize_gaussians
from quarc_ref.encoder.training.straight_through import position_step, translation_step
from quarc_ref.encoder.training.trainable import Attributes, from_splats
from quarc_ref.encoder.training.views import TrainingViews
from quarc_ref.format.records import StreamHeader
from quarc_ref.format.updates import UPDATE_FIELDS
from tests.datasets import scenes
from tests.encoder.masked_toys import ColumnMasks, add_masks
from tests.encoder.toys import SMALL, WIDTH, make_capture, make_context, make_splats

QUICK_SETTINGS = replace(SMALL, motion=replace(SMALL.motion, lr=2e-3))  # blobs move 0.05 per frame
ATTRIBUTE_NAMES = ("means", "rotations", "log_scales", "opacities", "sh_dc", "sh_rest")
FREE_FIELDS = {
    "still": (),
    "own": ("means",),
    "opacity": ("means", "opacities"),
    "dc": ("means", "opacities", "sh_dc"),
    "rest": ("means", "opacities", "sh_dc", "sh_rest"),
    "scales": ("means", "opacities", "sh_dc", "sh_rest", "log_scales"),
    "all": ATTRIBUTE_NAMES,
    "carried": tuple(name for name in ATTRIBUTE_NAMES if name != "sh_rest"),
    "turned": ("means", "rotations"),
}
TINY_OPTIONS = [
    "--preset", "demo", "--iterations", "2", "--ahead", "1", "--rungs", "still", "all",
    *("--set", "canonical.iterations=3"),
]  # fmt: skip


def _make_state():
    header = StreamHeader(gaussians_per_anchor=4)
    attributes = from_splats(make_splats(0), torch.device("cpu"))
    return begin_canonical(header, 0, quantize_gaussians(attributes, header))


def _begin_frame(frame=1):
    start_state = allow_updates(begin_frame(_make_state(), 0))
    return replace(start_state, scene=replace(start_state.scene, frame=frame))


def _move_frame():
    start_state = _begin_frame()
    levels = start_state.required_anchors.levels
    return move(start_state, [np.zeros((6, level.owners.size), dtype=np.int64) for level in levels])


def _make_attributes(start_state):
    return from_splats(dequantize(start_state.scene), torch.device("cpu"))


def _fit_rung(name, iterations=8, config=QUICK_SETTINGS):
    start_state = _begin_frame()
    return start_state, fit_rung(make_context(), start_state, RUNGS[name], iterations, config)


def _measure_moving_region(splats, frame=1):
    capture = make_capture()
    return Judge(capture, capture.cameras).measure(splats, frame)["training"]["moving_gain_psnr"]


@pytest.mark.parametrize("name", FREE_FIELDS)
def test_only_free_attributes_change(name):
    start_state, fit_result = _fit_rung(name)
    start_attributes = _make_attributes(start_state).rows(fit_result.survivors)

    for field in ATTRIBUTE_NAMES:
        has_changed = not torch.equal(
            getattr(fit_result.attributes, field), getattr(start_attributes, field)
        )
        assert has_changed == (field in FREE_FIELDS[name]), field


def test_every_rung_of_the_ladder_is_listed():
    assert list(RUNGS)[:9] == [
        "still", "anchors", "own", "deaths", "opacity", "dc", "rest", "scales", "all"
    ]  # fmt: skip
    assert RUNGS["all"].free - RUNGS["carried"].free == {"SH rest"}
    assert RUNGS["all"].free - {"deaths", "SH rest"} == set(UPDATE_FIELDS)


@pytest.mark.parametrize("name", ["anchors", "own"])
def test_free_gaussians_and_anchors_approach_the_later_frame(name):
    start_state, fit_result = _fit_rung(name, 30)
    static_psnr = _measure_moving_region(dequantize(start_state.scene))

    assert _measure_moving_region(to_splats(fit_result.attributes)) > static_psnr + 1
    assert _measure_moving_region(round_rung(start_state, fit_result).splats) > static_psnr + 1


def test_anchors_in_floats_are_close_to_the_decoded_symbols():
    start_state, fit_result = _fit_rung("anchors", 30)
    header, splats = start_state.scene.header, round_rung(start_state, fit_result).splats
    differences = np.abs(splats.positions - to_splats(fit_result.attributes).positions)

    assert differences.max() <= (header.level_count / 2 + 1) * translation_step(header)
    assert differences.max() > 0


def test_the_regularizer_of_motion_is_left_out():
    regularized_settings = replace(
        QUICK_SETTINGS, motion=replace(QUICK_SETTINGS.motion, rd_lambda=1e6)
    )

    assert torch.equal(
        _fit_rung("anchors", config=regularized_settings)[1].attributes.means,
        _fit_rung("anchors")[1].attributes.means,
    )


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
    start_state = _begin_frame()
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
    assert torch.equal(fit_result.attributes.opacities, _make_attributes(start_state).opacities[3:])
    assert rounded.change_counts["deaths"] == 3
    assert rounded.splats.positions.shape[0] == count - 3
    assert [step for _, step, _ in progress_calls] == list(range(1, 9))


def test_gaussians_behind_masks_stay_as_they_are():
    context = make_context()
    views = TrainingViews(add_masks(make_capture(), masks=ColumnMasks(WIDTH // 8)), context.device)
    masked_context, start_state = replace(context, views=views), _begin_frame(0)
    start_attributes = _make_attributes(start_state)
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
    assert len(_fit_rung("own")[1].survivors) == _begin_frame().scene.count


def test_an_offset_of_whole_steps_is_found_and_decoded_exactly():
    moved_state = _move_frame()
    header, attributes = moved_state.scene.header, _make_attributes(moved_state)
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
    decoded, float_splats = round_rung(_begin_frame(), fit_result).splats, to_splats(expected)

    assert np.array_equal(updates.residuals, step_counts[updates.gaussians, :13].T)
    assert np.array_equal(sh_rest_residuals, step_counts[:, 13:].T)
    for name in ("positions", "log_scales", "opacities", "sh"):
        assert np.allclose(getattr(decoded, name), getattr(float_splats, name), atol=1e-4), name
    assert np.allclose(
        np.abs((decoded.rotations * float_splats.rotations).sum(axis=1)), 1, atol=1e-5
    )


def test_a_stream_without_updates_equals_one_with_empty_updates():
    state = _make_state()
    state_with_updates = allow_updates(state)

    assert state_with_updates.scene.header.updates
    assert set(state_with_updates.required_recency) == {3}
    assert allow_updates(state_with_updates) is state_with_updates


def test_changes_below_half_a_step_cost_almost_nothing():
    start_state, fit_result = _fit_rung("still", 0)
    offset = position_step(start_state.scene.header) * 1e-3
    shifted_attributes = replace(fit_result.attributes, means=fit_result.attributes.means + offset)

    rounded = round_rung(start_state, replace(fit_result, attributes=shifted_attributes))

    assert rounded.change_counts["any"] == 0
    assert rounded.coded_bytes <= 8
    assert rounded.rest_bytes == 0


def test_bytes_grow_with_the_changes_and_sh_rest_is_listed_separately():
    start_state, fit_result = _fit_rung("carried")
    rounded = round_rung(start_state, fit_result)
    attributes = fit_result.attributes
    changed_attributes = replace(
        attributes, sh_rest=attributes.sh_rest + start_state.scene.header.sh_rest_step
    )
    rounded_with_sh_rest = round_rung(
        start_state, replace(fit_result, attributes=changed_attributes)
    )

    assert rounded.coded_bytes > round_rung(*_fit_rung("own")).coded_bytes > 0
    assert (rounded.rest_bytes, rounded_with_sh_rest.coded_bytes) == (0, rounded.coded_bytes)
    assert rounded_with_sh_rest.change_counts["SH rest"] == len(fit_result.survivors)


def test_a_free_gaussian_moves_as_fast_as_its_anchors_together():
    rate_factor = 1 + 2 + 4  # SMALL doubles the rate from level to level
    start_state, fit_result = _fit_rung("own", 1)
    shift = (fit_result.attributes.means - _make_attributes(start_state).means).abs().max()
    assert float(shift) == pytest.approx(rate_factor * QUICK_SETTINGS.motion.lr, rel=1e-3)

    _, slow_result = _fit_rung("slow", 1)
    shift = (slow_result.attributes.means - _make_attributes(start_state).means).abs().max()
    extent = make_context().views.extent
    learning_rates = canonical_learning_rates(QUICK_SETTINGS.canonical, extent)
    assert float(shift) == pytest.approx(learning_rates[0], rel=1e-2)


def test_sh_rest_can_be_trained_as_fast_as_dc():
    ratio = (
        canonical_learning_rates(SMALL.canonical, 1.0)[4]
        / canonical_learning_rates(SMALL.canonical, 1.0)[5]
    )

    assert RUNGS["fast-rest"].sh_rest_rate_factor == pytest.approx(ratio)
    slow_change, fast_change = (
        _fit_rung(name)[1].attributes.sh_rest.abs().max() for name in ("all", "fast-rest")
    )
    assert fast_change > 5 * slow_change


def test_a_static_scene_is_listed_once_and_short_fits_come_first():
    rungs = [RUNGS["still"], RUNGS["own"]]

    assert [task.name for task in list_tasks(rungs, [1, 5], [30, 10])] == [
        "ahead1.still.0", "ahead1.own.10", "ahead5.still.0", "ahead5.own.10",
        "ahead1.own.30", "ahead5.own.30",
    ]  # fmt: skip


def test_existing_rows_are_not_computed_again(tmp_path):
    capture = make_capture()
    make_ladder = partial(Ladder, capture, capture.cameras, _make_state())
    existing_task, missing_task = Task(RUNGS["own"], 1, 3), Task(RUNGS["own"], 1, 4)
    make_ladder("here", QUICK_SETTINGS, tmp_path).compute_missing([existing_task], make_context())
    path = tmp_path / "rows" / "ahead1.own.3.json"
    row_bytes = path.read_bytes()

    second_ladder = make_ladder("here", QUICK_SETTINGS, tmp_path)
    second_ladder.compute_missing([existing_task, missing_task], make_context())

    assert path.read_bytes() == row_bytes
    assert second_ladder.load_task_row(existing_task) == json.loads(row_bytes)
    assert second_ladder.load_task_row(missing_task)["iterations"] == 4
    assert make_ladder("elsewhere", QUICK_SETTINGS, tmp_path).load_task_row(existing_task) is None
    assert make_ladder("here", SMALL, tmp_path).load_task_row(existing_task) is None


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ladder") / "plane"
    return scenes.write_n3dv(folder, scenes.make_shots(), 3, scenes.make_plane_points())


def test_the_command_encodes_the_initial_stream_and_continues(folder, tmp_path, capsys):
    options = [str(folder), "--out", str(tmp_path), *TINY_OPTIONS]
    assert command.main(options) == 0
    first_output = capsys.readouterr()
    (stream,) = tmp_path.glob("*.quarc")

    assert command.main([*options, "--stream", str(stream)]) == 0
    second_output = capsys.readouterr()

    assert "2 of 2 rows exist already" in second_output.err
    assert second_output.out == first_output.out
    header_line, _, static_line, all_line = first_output.out.strip().splitlines()
    assert header_line.startswith("| ahead | iterations | free |")
    assert static_line.startswith("| 1 | 0 | nothing |")
    assert all_line.startswith("| 1 | 2 | + rotations (all fields) |")
    assert (tmp_path / "ladder.md").read_text() == first_output.out


@pytest.mark.parametrize(
    ("extra_options", "message"),
    [
        (["--frame", "1"], "no frame 1"),
        (["--ahead", "7"], "frame 7 is needed, but the capture has only 3 frames"),
        (["--set", "motion.speed=1"], "no setting 'motion.speed'"),
        (["--stream", "nowhere.quarc"], "nowhere.quarc"),
    ],
)
def test_an_impossible_combination_is_rejected_in_one_line(
    folder, tmp_path, capsys, extra_options, message
):
    assert command.main([str(folder), "--out", str(tmp_path), *TINY_OPTIONS]) == 0
    (stream,) = tmp_path.glob("*.quarc")
    capsys.readouterr()

    options = [
        str(folder),
        "--out",
        str(tmp_path),
        *TINY_OPTIONS,
        "--stream",
        str(stream),
        *extra_options,
    ]
    assert command.main(options) == 2
    error = capsys.readouterr().err
    assert error.startswith("ladder.py: ")
    assert message in error
    assert error.count("\n") == 1
