"""The ladder on a toy capture, with minimal training."""

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
from quarc_ref.format.records import StreamHeader
from quarc_ref.format.updates import UPDATE_FIELDS
from tests.datasets import scenes
from tests.encoder.toys import SMALL, make_capture, make_context, make_splats

QUICK_SETTINGS = replace(SMALL, motion=replace(SMALL.motion, lr=2e-3))  # blobs move 0.05 per frame
NAMES = ("means", "rotations", "log_scales", "opacities", "sh_dc", "sh_rest")
FREE = {
    "still": (),
    "own": ("means",),
    "opacity": ("means", "opacities"),
    "dc": ("means", "opacities", "sh_dc"),
    "rest": ("means", "opacities", "sh_dc", "sh_rest"),
    "scales": ("means", "opacities", "sh_dc", "sh_rest", "log_scales"),
    "all": NAMES,
    "carried": tuple(name for name in NAMES if name != "sh_rest"),
    "turned": ("means", "rotations"),
}
TINY = [
    "--preset", "demo", "--iterations", "2", "--ahead", "1", "--rungs", "still", "all",
    *("--set", "canonical.iterations=3"),
]  # fmt: skip


def _state():
    header = StreamHeader(gaussians_per_anchor=4)
    start = from_splats(make_splats(0), torch.device("cpu"))
    return begin_canonical(header, 0, quantize_gaussians(start, header))


def _begun(ahead=1):
    started = allow_updates(begin_frame(_state(), 0))
    return replace(started, scene=replace(started.scene, frame=ahead))


def _moved():
    started = _begun()
    levels = started.known_anchors.levels
    return move(started, [np.zeros((6, level.owners.size), dtype=np.int64) for level in levels])


def _start(started):
    return from_splats(dequantize(started.scene), torch.device("cpu"))


def _fit(name, iterations=8, config=QUICK_SETTINGS):
    started = _begun()
    return started, fit_rung(make_context(), started, RUNGS[name], iterations, config)


def _moving(splats, frame=1):
    capture = make_capture()
    return Judge(capture, capture.cameras).measure(splats, frame)["training"]["moving_gain_psnr"]


@pytest.mark.parametrize("name", FREE)
def test_only_free_attributes_change(name):
    started, fitted = _fit(name)
    start = _start(started).rows(fitted.alive)

    for field in NAMES:
        changed = not torch.equal(getattr(fitted.attributes, field), getattr(start, field))
        assert changed == (field in FREE[name]), field


def test_every_rung_of_the_ladder_is_listed():
    assert list(RUNGS)[:9] == [
        "still", "anchors", "own", "deaths", "opacity", "dc", "rest", "scales", "all"
    ]  # fmt: skip
    assert RUNGS["all"].free - RUNGS["carried"].free == {"SH rest"}
    assert RUNGS["all"].free - {"deaths", "SH rest"} == set(UPDATE_FIELDS)


@pytest.mark.parametrize("name", ["anchors", "own"])
def test_free_gaussians_and_anchors_approach_the_later_frame(name):
    started, fitted = _fit(name, 30)
    still = _moving(dequantize(started.scene))

    assert _moving(to_splats(fitted.attributes)) > still + 1
    assert _moving(round_rung(started, fitted).splats) > still + 1


def test_anchors_in_floats_are_close_to_the_decoded_symbols():
    started, fitted = _fit("anchors", 30)
    header, splats = started.scene.header, round_rung(started, fitted).splats
    apart = np.abs(splats.positions - to_splats(fitted.attributes).positions)

    assert apart.max() <= (header.level_count / 2 + 1) * translation_step(header)
    assert apart.max() > 0


def test_the_regularizer_of_motion_is_left_out():
    strict = replace(QUICK_SETTINGS, motion=replace(QUICK_SETTINGS.motion, rd_lambda=1e6))

    assert torch.equal(
        _fit("anchors", config=strict)[1].attributes.means, _fit("anchors")[1].attributes.means
    )


def _with_spot():
    """The toy's attributes in frame 0, and one Gaussian outside all pictures."""
    start = from_splats(make_splats(0), torch.device("cpu"))
    spot = start.rows(torch.tensor([len(start.means) - 1]))
    spot = replace(spot, means=torch.tensor([[0.0, 0.0, -0.9]]), sh_dc=9 + 0 * spot.sh_dc)
    return start.joined(replace(spot, log_scales=spot.log_scales + 1))


def test_only_gaussians_in_the_way_die():
    dying = choose_deletions(make_context(), _with_spot(), 0, 0.2)

    assert dying.nonzero().tolist() == [[len(dying) - 1]]


def test_dying_gaussians_leave_at_half_time_and_the_others_keep_their_opacity(monkeypatch):
    started = _begun()
    count, steps = started.scene.count, []
    dead = torch.arange(count) < 3
    monkeypatch.setattr("ladder.fitting.choose_deletions", lambda *_: dead)
    progress = SimpleNamespace(advance=lambda *at: steps.append(at))
    context = replace(make_context(), observers=Observers(progress))

    fitted = fit_rung(context, started, RUNGS["deaths"], 8, QUICK_SETTINGS)
    rounded = round_rung(started, fitted)

    assert fitted.alive.tolist() == list(range(3, count))
    assert torch.equal(fitted.attributes.opacities, _start(started).opacities[3:])
    assert rounded.change_counts["deaths"] == 3
    assert rounded.splats.positions.shape[0] == count - 3
    assert [done for _, done, _ in steps] == list(range(1, 9))


def test_with_free_motion_no_gaussian_dies():
    assert len(_fit("own")[1].alive) == _begun().scene.count


def test_an_offset_of_whole_steps_is_found_and_decoded_exactly():
    moved = _moved()
    header, start = moved.scene.header, _start(moved)
    rng = np.random.default_rng(5)
    asked = rng.integers(-40, 41, (moved.scene.count, 22)).astype(np.float32)
    steps = torch.from_numpy(asked)
    wanted = Attributes(
        start.means + steps[:, :3] * translation_step(header),
        2 * rotate(start.rotations, steps[:, 3:6] / header.rotation_unity),
        start.log_scales + steps[:, 6:9] * header.log_scale_step,
        start.opacities + steps[:, 9] * header.opacity_step,
        start.sh_dc + steps[:, None, 10:13] * header.sh_dc_step,
        start.sh_rest + steps[:, 13:].reshape(-1, 3, 3) * header.sh_rest_step,
    )
    fitted = FitResult(wanted, torch.arange(moved.scene.count))

    updates, rest = find_updates(moved, fitted)
    decoded, floats = round_rung(_begun(), fitted).splats, to_splats(wanted)

    assert np.array_equal(updates.residuals, asked[updates.gaussians, :13].T)
    assert np.array_equal(rest, asked[:, 13:].T)
    for name in ("positions", "log_scales", "opacities", "sh"):
        assert np.allclose(getattr(decoded, name), getattr(floats, name), atol=1e-4), name
    assert np.allclose(np.abs((decoded.rotations * floats.rotations).sum(axis=1)), 1, atol=1e-5)


def test_a_stream_without_updates_equals_one_with_empty_updates():
    state = _state()
    allowed = allow_updates(state)

    assert allowed.scene.header.updates
    assert set(allowed.known_recency) == {3}
    assert allow_updates(allowed) is allowed


def test_changes_below_half_a_step_cost_almost_nothing():
    started, fitted = _fit("still", 0)
    offset = position_step(started.scene.header) * 1e-3
    near = replace(fitted.attributes, means=fitted.attributes.means + offset)

    rounded = round_rung(started, replace(fitted, attributes=near))

    assert rounded.change_counts["any"] == 0
    assert rounded.coded_bytes <= 8
    assert rounded.rest_bytes == 0


def test_bytes_grow_with_the_changes_and_sh_rest_is_listed_separately():
    started, fitted = _fit("carried")
    carried = round_rung(started, fitted)
    start = fitted.attributes
    brighter = replace(start, sh_rest=start.sh_rest + started.scene.header.sh_rest_step)
    more = round_rung(started, replace(fitted, attributes=brighter))

    assert carried.coded_bytes > round_rung(*_fit("own")).coded_bytes > 0
    assert (carried.rest_bytes, more.coded_bytes) == (0, carried.coded_bytes)
    assert more.change_counts["SH rest"] == len(fitted.alive)


def test_a_free_gaussian_moves_as_fast_as_its_anchors_together():
    levels = 1 + 2 + 4  # SMALL doubles the rate from level to level
    started, fitted = _fit("own", 1)
    shift = (fitted.attributes.means - _start(started).means).abs().max()
    assert float(shift) == pytest.approx(levels * QUICK_SETTINGS.motion.lr, rel=1e-3)

    _, slow = _fit("slow", 1)
    shift = (slow.attributes.means - _start(started).means).abs().max()
    rate = canonical_learning_rates(QUICK_SETTINGS.canonical, make_context().views.extent)[0]
    assert float(shift) == pytest.approx(rate, rel=1e-2)


def test_sh_rest_can_be_trained_as_fast_as_dc():
    ratio = (
        canonical_learning_rates(SMALL.canonical, 1.0)[4]
        / canonical_learning_rates(SMALL.canonical, 1.0)[5]
    )

    assert RUNGS["fast-rest"].rest_factor == pytest.approx(ratio)
    slow, fast = (_fit(name)[1].attributes.sh_rest.abs().max() for name in ("all", "fast-rest"))
    assert fast > 5 * slow


def test_a_static_scene_is_listed_once_and_short_fits_come_first():
    rungs = [RUNGS["still"], RUNGS["own"]]

    assert [task.name for task in list_tasks(rungs, [1, 5], [30, 10])] == [
        "ahead1.still.0", "ahead1.own.10", "ahead5.still.0", "ahead5.own.10",
        "ahead1.own.30", "ahead5.own.30",
    ]  # fmt: skip


def test_existing_rows_are_not_computed_again(tmp_path):
    capture = make_capture()
    begin = partial(Ladder, capture, capture.cameras, _state())
    task, other = Task(RUNGS["own"], 1, 3), Task(RUNGS["own"], 1, 4)
    begin("here", QUICK_SETTINGS, tmp_path).compute_missing([task], make_context())
    path = tmp_path / "rows" / "ahead1.own.3.json"
    written = path.read_bytes()

    again = begin("here", QUICK_SETTINGS, tmp_path)
    again.compute_missing([task, other], make_context())

    assert path.read_bytes() == written
    assert again.load_task_row(task) == json.loads(written)
    assert again.load_task_row(other)["iterations"] == 4
    assert begin("elsewhere", QUICK_SETTINGS, tmp_path).load_task_row(task) is None
    assert begin("here", SMALL, tmp_path).load_task_row(task) is None


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ladder") / "plane"
    return scenes.write_n3dv(folder, scenes.make_shots(), 3, scenes.make_plane_points())


def test_the_command_encodes_the_initial_stream_and_continues(folder, tmp_path, capsys):
    words = [str(folder), "--out", str(tmp_path), *TINY]
    assert command.main(words) == 0
    first = capsys.readouterr()
    (stream,) = tmp_path.glob("*.quarc")

    assert command.main([*words, "--stream", str(stream)]) == 0
    again = capsys.readouterr()

    assert "2 of 2 rows exist already" in again.err
    assert again.out == first.out
    head, _, still, everything = first.out.strip().splitlines()
    assert head.startswith("| ahead | iterations | free |")
    assert still.startswith("| 1 | 0 | nothing |")
    assert everything.startswith("| 1 | 2 | + rotations, which is all |")
    assert (tmp_path / "ladder.md").read_text() == first.out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--frame", "1"], "no frame 1"),
        (["--ahead", "7"], "frame 7 is needed, but the capture has only 3 frames"),
        (["--set", "motion.speed=1"], "no setting 'motion.speed'"),
        (["--stream", "nowhere.quarc"], "nowhere.quarc"),
    ],
)
def test_an_impossible_combination_is_rejected_in_one_line(
    folder, tmp_path, capsys, words, message
):
    assert command.main([str(folder), "--out", str(tmp_path), *TINY]) == 0
    (stream,) = tmp_path.glob("*.quarc")
    capsys.readouterr()

    given = [str(folder), "--out", str(tmp_path), *TINY, "--stream", str(stream), *words]
    assert command.main(given) == 2
    error = capsys.readouterr().err
    assert error.startswith("ladder.py: ")
    assert message in error
    assert error.count("\n") == 1
