"""Tests of the findings of `encode` for captures with problems."""

import json
import sys

import numpy as np
import pytest

from quarc_ref.cli.encode_findings import FindingCollector
from quarc_ref.datasets.findings import Finding
from quarc_ref.encoder import encode_options, encode_stream, segments
from tests.cli.commands import TINY_OPTIONS, list_names, run, run_json
from tests.datasets import scenes

_FINDING = Finding("pose-disagrees", "the pictures of cam02 are elsewhere", ("cam02",))
_TRAINING_FINDING = Finding("first-frame-coarse", "the first frame is coarse")


@pytest.fixture
def added_findings(monkeypatch):
    """Add a finding before training and a finding after training to every encode."""
    monkeypatch.setattr(encode_options, "check_capture", lambda _: [_FINDING])
    monkeypatch.setattr(encode_stream, "check_first_frame", lambda *_: [_TRAINING_FINDING])


def _make_command(capture, file, *options):
    return ["encode", capture, "-o", file, *TINY_OPTIONS, "--frames", 2, *options]


class _ClosedPipe:
    def write(self, _text):
        raise BrokenPipeError


def test_an_encode_continues_if_nobody_reads_its_findings(monkeypatch):
    monkeypatch.setattr(sys, "stderr", _ClosedPipe())
    findings = FindingCollector()

    findings.add(_FINDING)

    assert [finding["kind"] for finding in findings.as_json()] == [_FINDING.kind]


@pytest.mark.usefixtures("added_findings")
def test_findings_are_printed_on_stderr_and_listed_in_json(capture, tmp_path):
    result = run(*_make_command(capture, tmp_path / "a.quarc", "--json", "--quiet"))

    assert result.exit_code == 0
    assert result.stderr.splitlines() == [
        "quarc-ref: warning: the pictures of cam02 are elsewhere",
        "quarc-ref: warning: the first frame is coarse",
    ]
    assert json.loads(result.stdout)["findings"] == [
        {"kind": finding.kind, "message": finding.message, "cameras": list(finding.cameras)}
        for finding in (_FINDING, _TRAINING_FINDING)
    ]


@pytest.mark.usefixtures("added_findings")
def test_without_checks_only_the_first_frame_is_checked(capture, tmp_path):
    json_output = run_json(*_make_command(capture, tmp_path / "a.quarc", "--no-checks"))

    assert [finding["kind"] for finding in json_output["findings"]] == ["first-frame-coarse"]


def test_a_missed_target_size_is_reported_at_the_end(capture, tmp_path):
    command = _make_command(capture, tmp_path / "a.quarc", "--no-checks")
    json_output = run_json(*command, "--target-kb-per-frame", 0.01)

    assert "target-exceeded" in [finding["kind"] for finding in json_output["findings"]]


@pytest.mark.usefixtures("added_findings")
def test_findings_of_a_piped_encode_are_printed_on_stderr(capture):
    result = run(*_make_command(capture, "-"))

    assert result.stderr.count("warning: ") == 2


def _run_jobs_in_process(function, jobs, *_):
    """Run jobs as `run_jobs` does, but in this process."""
    return [function(job.argument) for job in jobs]


@pytest.mark.usefixtures("added_findings")
def test_a_capture_in_segments_is_checked_once_and_each_first_frame_too(
    capture, tmp_path, monkeypatch
):
    monkeypatch.setattr(segments, "run_jobs", _run_jobs_in_process)
    json_output = run_json(*_make_command(capture, tmp_path / "a.quarc", "--segments", 2))

    assert [finding["message"] for finding in json_output["findings"]] == [
        "the pictures of cam02 are elsewhere",
        "frames 0 to 0: the first frame is coarse",
        "frames 1 to 1: the first frame is coarse",
    ]


@pytest.fixture
def capture_with_two_cameras(tmp_path):
    """A capture with two cameras, one of them held out."""
    shots = scenes.make_shots()[:2]
    return scenes.write_n3dv(tmp_path / "narrow", shots, 2, scenes.make_plane_points())


@pytest.fixture
def capture_with_lost_points(tmp_path):
    """A capture whose initial points are outside all views."""
    points = scenes.make_plane_points()
    distant_points = type(points)(points.positions + np.float32(1e4), points.colors)
    return scenes.write_n3dv(tmp_path / "lost", scenes.make_shots(), 2, distant_points)


@pytest.mark.parametrize("options", [[], ["--segments", 2]])
def test_one_training_camera_is_rejected_before_any_work(
    capture_with_two_cameras, tmp_path, options
):
    result = run(*_make_command(capture_with_two_cameras, tmp_path / "a.quarc", *options))

    assert result.exit_code == 3
    assert "narrow has 1 training camera, but estimating depth needs at least 2" in result.stderr
    assert "use --no-checks to encode" in result.stderr
    assert list_names(tmp_path) == ["narrow"]


def test_one_training_camera_is_encoded_without_checks(capture_with_two_cameras, tmp_path):
    json_output = run_json(
        *_make_command(capture_with_two_cameras, tmp_path / "a.quarc", "--no-checks")
    )

    assert json_output["frames"] == 2


def test_points_outside_all_views_are_rejected(capture_with_lost_points, tmp_path):
    result = run(*_make_command(capture_with_lost_points, tmp_path / "a.quarc"))

    assert result.exit_code == 3
    assert "initial points of capture lost is visible in a training view" in result.stderr


def test_a_rejected_segment_is_never_started(capture_with_two_cameras, tmp_path, monkeypatch):
    def reject(*_):
        message = "a segment was begun"
        raise AssertionError(message)

    monkeypatch.setattr(segments, "encode_segments", reject)

    assert (
        run(
            *_make_command(capture_with_two_cameras, tmp_path / "a.quarc", "--segments", 2)
        ).exit_code
        == 3
    )
