"""Frames of held-out cameras that `quarc-capture.json` ignores are not measured."""

import csv
import io
import json
import shutil

import pytest

from quarc_ref.evaluation.comparison.entries import EntryError, Label
from quarc_ref.evaluation.comparison.measure import measure_entries
from quarc_ref.evaluation.comparison.open_entries import (
    ComparisonOptions,
    EntrySource,
    open_entries,
)
from quarc_ref.evaluation.comparison.summary import summarize
from quarc_ref.evaluation.comparison.tables import format_views_csv
from quarc_ref.evaluation.evaluate import EvaluationOptions, evaluate_stream
from quarc_ref.evaluation.same_capture import MismatchError
from tests.evaluation.conftest import ignore_progress

_SPANS = {"cam01": [1, 2], "cam04": [[2, 3]]}


@pytest.fixture
def failing_folder(folder, tmp_path):
    """The capture without frames 1 and 2 of cam01, and without frames 2 and 3 of cam04."""
    copy = shutil.copytree(folder, tmp_path / "failing")
    (copy / "quarc-capture.json").write_text(json.dumps({"ignored_frames": _SPANS}))
    return copy


def test_only_used_pictures_are_measured(stream, failing_folder, evaluation):
    failing = evaluate_stream(stream, failing_folder, ignore_progress)

    assert failing.frames == (0, 1, 3)
    whole = evaluation.quality.per_camera
    cam01, cam04 = (failing.quality.per_camera[name] for name in ("cam01", "cam04"))
    assert cam01[1] == cam04[2] == {}
    for frame, metrics in ((0, cam01[0]), (3, cam01[2])):
        assert metrics["psnr"] == whole["cam01"][frame]["psnr"]
    psnr = [whole["cam04"][1]["psnr"], whole["cam01"][3]["psnr"]]
    assert failing.quality.psnr[1:] == pytest.approx(psnr)
    assert failing.quality.mean()["psnr"] is not None
    assert failing.quality.count_views_at_max_psnr() == (0, 4)
    assert [view.camera for view in failing.shown_views] == ["cam01", "cam04", "cam01"]


def test_frames_without_measurements_are_null_in_json(stream, failing_folder):
    failing = evaluate_stream(stream, failing_folder, ignore_progress)

    printed = failing.quality.as_json(failing.frames)

    for metric in ("psnr", "ssim"):
        values = printed[f"{metric}_per_frame"]
        assert [value is None for value in values] == [False, False, True, False]


def test_a_camera_without_any_measured_view_has_no_values(stream, failing_folder):
    notes = {"ignored_frames": {"cam01": [[0, None]]}}
    (failing_folder / "quarc-capture.json").write_text(json.dumps(notes))
    quality = evaluate_stream(stream, failing_folder, ignore_progress).quality

    cam01, cam04 = quality.by_camera().values()
    assert cam01 == dict.fromkeys(cam04)
    assert quality.mean() == cam04
    first, second, mean = quality.as_rows()
    assert first == ["cam01", *["-"] * len(quality.headings())]
    assert second[1:] == mean[1:]


def test_frames_that_no_held_out_camera_shows_cannot_be_measured(stream, failing_folder):
    with pytest.raises(MismatchError, match="ignores these frames of all held-out cameras"):
        evaluate_stream(stream, failing_folder, ignore_progress, EvaluationOptions(span=(2, 3)))


def _compare(stream, folder, tmp_path, span=(0, None)):
    (tmp_path / "a.quarc").write_bytes(stream)
    sources = [EntrySource(Label(name, name), tmp_path / "a.quarc") for name in "ab"]
    options = ComparisonOptions(capture=folder)
    return measure_entries(
        open_entries(sources, options, ignore_progress), span, None, ignore_progress
    )


def test_a_comparison_leaves_out_the_same_pictures(stream, failing_folder, tmp_path):
    comparison = _compare(stream, failing_folder, tmp_path)
    failing = evaluate_stream(stream, failing_folder, ignore_progress)

    assert comparison.frames == (0, 1, 3)
    for entry in comparison.measured_entries:
        assert entry.quality.per_camera == failing.quality.per_camera
    rows = list(csv.DictReader(io.StringIO(format_views_csv(comparison).decode())))
    views = [(row["camera"], row["frame"]) for row in rows if row["method"] == "a"]
    assert views == [("cam01", "0"), ("cam01", "3"), ("cam04", "0"), ("cam04", "1")]
    _, second = summarize(comparison).points
    assert second.paired_difference.psnr.mean == 0
    with pytest.raises(EntryError, match="none of the frames"):
        _compare(stream, failing_folder, tmp_path, (2, 3))
