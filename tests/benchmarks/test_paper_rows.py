import json
from dataclasses import replace

import pytest

import canonical_cache
from paper import rows
from paper.rows import Task, make_row
from paper.tables import COLUMNS
from paper.trials import Trial
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.evaluation.evaluate import evaluate_stream
from quarc_ref.inspection.inspect_stream import inspect_stream
from tests.datasets import scenes
from tests.encoder.toys import SMALL

OPTIONS = CaptureOptions()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("paper") / "plane"
    return scenes.write_n3dv(folder, scenes.make_shots(), 3, scenes.make_plane_points())


@pytest.fixture(scope="module")
def task(folder, tmp_path_factory):
    trial = Trial("full", "full", SMALL)
    full_task = Task(trial, folder, OPTIONS, 3, tmp_path_factory.mktemp("kept"))
    make_row(full_task)
    return full_task


@pytest.fixture(scope="module")
def row(task):
    return json.loads(task.row_path.read_text())


def test_its_figures_are_those_of_the_kept_stream(task, row, folder):
    data = task.stream_path.read_bytes()
    evaluation = evaluate_stream(data, folder, lambda *_: None)
    summary = inspect_stream(data)

    assert row["per_frame"]["psnr"] == list(evaluation.quality.psnr)
    assert row["quality"]["ssim"] == pytest.approx(sum(evaluation.quality.ssim) / 3)
    assert row["bytes"]["total"] == len(data)
    assert row["bytes"]["canonical_kb"] * 1024 == summary.coded_bytes()["canonical"]
    assert row["bytes"]["kb_per_frame"] == summary.kilobytes_per_frame()["without_canonical"]
    assert row["births"] == [frame.births for frame in summary.frames]
    assert row["gaussians"] == [frame.gaussians for frame in summary.frames]


def test_updates_have_a_size_and_an_estimate_of_their_own(task):
    (get_estimate,) = (value for heading, value, _ in COLUMNS if heading.startswith("estimate"))
    canonical, *later = inspect_stream(task.stream_path.read_bytes()).frames
    later = [
        replace(
            frame,
            coded_bytes=frame.coded_bytes | {"updates": 3072},
            estimate_bytes=dict.fromkeys(frame.estimate_bytes, 0.0)
            | {"motion": 512.0, "updates": 2048.0, "births": 256.0},
        )
        for frame in later
    ]
    canonical = replace(canonical, estimate_bytes=dict.fromkeys(canonical.estimate_bytes, 0.0))
    sizes = rows._summarize_sizes((canonical, *later), 50_000)

    assert sizes["updates_kb_per_frame"] == 3
    assert get_estimate({"bytes": sizes}) == 2.75
    del sizes["updates_estimate_kb_per_frame"]
    assert get_estimate({"bytes": sizes}) is None  # as in a row of an earlier version


def test_a_row_lists_everything_it_depends_on(row):
    assert row["seed"] == SMALL.seed
    assert row["renderer"]["training"] == "numba"
    assert row["protocol"]["cameras"]["held_out"] == ["cam00"]
    assert set(row["protocol"]["metrics"]) == {"psnr", "ssim", "psnr_moving"}
    stages = {"canonical", "anchors", "motion", "placement", "births", "commit"}
    assert all(row["seconds"][stage] > 0 for stage in stages)
    assert row["quality"]["psnr_moving"] != row["quality"]["psnr"]


def test_an_existing_row_is_not_computed_again(task, monkeypatch):
    monkeypatch.setattr(rows, "encode", None)
    modified_before = task.row_path.stat().st_mtime_ns
    make_row(task)

    assert task.row_path.stat().st_mtime_ns == modified_before


@pytest.mark.parametrize(
    "changed_inputs",
    [
        {"trial": Trial("full", "full", replace(SMALL, seed=1))},
        {"trial": Trial("full", "full", SMALL, "motion")},
        {"trial": Trial("full", "full", SMALL, "all", rebinds=True)},
        {"frames": 2},
        {"options": CaptureOptions(downscale=2)},
        {"options": CaptureOptions(held_out=("cam01",))},
        {"device": "cuda"},
    ],
)
def test_a_row_of_other_inputs_is_not_reused(task, folder, changed_inputs):
    fingerprint = open_capture(folder).fingerprint

    assert task.load_saved_row(fingerprint) is not None
    assert replace(task, **changed_inputs).load_saved_row(fingerprint) is None
    assert task.load_saved_row("f" * 64) is None


def test_a_row_made_with_other_lpips_weights_is_not_reused(task, tmp_path):
    keys = [task.compute_key("f" * 64)]
    for number in range(2):
        weights = tmp_path / f"{number}.pth"
        weights.write_bytes(bytes([number]))
        keys.append(replace(task, lpips=weights).compute_key("f" * 64))

    assert len(set(keys)) == 3


def test_frame_0_is_trained_once_for_trials_that_differ_only_in_motion(task, monkeypatch):
    motion = replace(SMALL.motion, iterations=2)
    trial = Trial("short", "short", replace(SMALL, motion=motion))
    monkeypatch.setattr(canonical_cache, "train_canonical", None)
    make_row(replace(task, trial=trial))

    full_row, short_row = (
        json.loads((task.folder / "rows" / f"{name}.json").read_text())
        for name in ("full", "short")
    )
    assert full_row["canonical_sha256"] == short_row["canonical_sha256"]
    assert full_row["seconds"]["canonical"] == short_row["seconds"]["canonical"]


def test_other_canonical_settings_train_again(task, monkeypatch):
    calls = []

    def stop(*_):
        calls.append(1)
        raise InterruptedError

    canonical = replace(SMALL.canonical, iterations=3)
    monkeypatch.setattr(canonical_cache, "train_canonical", stop)
    for trial in (
        Trial("other", "other", replace(SMALL, canonical=canonical)),
        Trial("seed", "seed", replace(SMALL, seed=4)),
        Trial("steps", "steps", replace(SMALL, stream=replace(SMALL.stream, rotation_bits=5))),
        Trial("floats", "floats", SMALL, "all"),
    ):
        with pytest.raises(InterruptedError):
            make_row(replace(task, trial=trial))
    assert len(calls) == 4


def test_a_trial_in_floats_has_the_same_figures_and_no_stream(task):
    float_task = replace(task, trial=Trial("float", "float", SMALL, "all"))
    make_row(float_task)
    row, quantized_row = (
        json.loads(trial_task.row_path.read_text()) for trial_task in (float_task, task)
    )

    assert row.keys() == quantized_row.keys()
    assert not float_task.stream_path.exists()
    assert row["bytes"]["kb_per_frame"] > 4 * quantized_row["bytes"]["kb_per_frame"]
    assert row["quality"]["psnr"] == pytest.approx(quantized_row["quality"]["psnr"], abs=2.0)
