"""Tests the ladder benchmark on a toy capture with minimal training."""

import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import torch

from ladder import command
from ladder.judging import Judge
from ladder.rounding import round_rung, to_splats
from ladder.rows import Ladder, Task, list_tasks
from ladder.rungs import RUNGS
from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.encoder.training.learning_rates import canonical_learning_rates
from quarc_ref.encoder.training.straight_through import translation_step
from quarc_ref.format.updates import UPDATE_FIELDS
from tests.benchmarks.ladder_toys import (
    QUICK_SETTINGS,
    fit_toy_rung,
    make_attributes,
    make_state,
)
from tests.datasets import scenes
from tests.encoder.toys import SMALL, make_capture, make_context

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


def _measure_moving_region(splats, frame=1):
    capture = make_capture()
    return Judge(capture, capture.cameras).measure(splats, frame)["training"]["moving_gain_psnr"]


@pytest.mark.parametrize("name", FREE_FIELDS)
def test_only_free_attributes_change(name):
    start_state, fit_result = fit_toy_rung(name)
    start_attributes = make_attributes(start_state).rows(fit_result.survivors)

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
    start_state, fit_result = fit_toy_rung(name, 30)
    static_psnr = _measure_moving_region(dequantize(start_state.scene))

    assert _measure_moving_region(to_splats(fit_result.attributes)) > static_psnr + 1
    assert _measure_moving_region(round_rung(start_state, fit_result).splats) > static_psnr + 1


def test_anchors_in_floats_are_close_to_the_decoded_symbols():
    start_state, fit_result = fit_toy_rung("anchors", 30)
    header, splats = start_state.scene.header, round_rung(start_state, fit_result).splats
    differences = np.abs(splats.positions - to_splats(fit_result.attributes).positions)

    assert differences.max() <= (header.level_count / 2 + 1) * translation_step(header)
    assert differences.max() > 0


def test_the_regularizer_of_motion_is_left_out():
    regularized_settings = replace(
        QUICK_SETTINGS, motion=replace(QUICK_SETTINGS.motion, rd_lambda=1e6)
    )

    assert torch.equal(
        fit_toy_rung("anchors", config=regularized_settings)[1].attributes.means,
        fit_toy_rung("anchors")[1].attributes.means,
    )


def test_a_free_gaussian_moves_as_fast_as_its_anchors_together():
    rate_factor = 1 + 2 + 4  # SMALL doubles the rate from level to level
    start_state, fit_result = fit_toy_rung("own", 1)
    shift = (fit_result.attributes.means - make_attributes(start_state).means).abs().max()
    assert float(shift) == pytest.approx(rate_factor * QUICK_SETTINGS.motion.lr, rel=1e-3)

    _, slow_result = fit_toy_rung("slow", 1)
    shift = (slow_result.attributes.means - make_attributes(start_state).means).abs().max()
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
        fit_toy_rung(name)[1].attributes.sh_rest.abs().max() for name in ("all", "fast-rest")
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
    make_ladder = partial(Ladder, capture, capture.cameras, make_state())
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


@pytest.fixture(scope="module")
def stream(folder, tmp_path_factory):
    """The initial stream that a run of the command has encoded."""
    output_folder = tmp_path_factory.mktemp("ladder")
    assert command.main([str(folder), "--out", str(output_folder), *TINY_OPTIONS]) == 0
    (stream,) = output_folder.glob("*.quarc")
    return stream


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
    folder, stream, tmp_path, capsys, extra_options, message
):
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
