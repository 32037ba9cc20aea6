"""Every planted fault is reported, and correct captures have no findings."""

import os
import shutil
from pathlib import Path

import pytest

from quarc_ref.datasets.open_capture import CaptureOptions
from quarc_ref.encoder import choose_preset, doctor
from quarc_ref.encoder.checks.machine import FreeResources
from quarc_ref.encoder.doctor import ExamineOptions, examine
from quarc_ref.synth import SynthOptions, write_synthetic_capture
from tests.encoder.planted_files import (
    CAMERA,
    FAULTS,
    begin_with_black,
    damage_frame,
    delay_video,
    repeat_frames,
)
from tests.marks import thorough

_STILL_CAPTURE = Path(__file__).resolve().parents[3] / "shared" / "data" / "n3dv_flame_steak_frame0"
_DEMO = choose_preset("demo")


@pytest.fixture(scope="session")
def correct_capture(tmp_path_factory):
    """A synthetic capture of seven cameras and 15 frames."""
    folder = tmp_path_factory.mktemp("correct_capture") / "room"
    write_synthetic_capture(folder, SynthOptions(128, 96, frames=15, cameras=6))
    return folder


@pytest.fixture
def folder(correct_capture, tmp_path):
    """A copy of the correct capture, in which tests plant a fault."""
    return shutil.copytree(correct_capture, tmp_path / "room")


def find_faults(folder, **options):
    return examine(folder, ExamineOptions(config=_DEMO, device="cpu", **options)).findings


def test_a_correct_capture_has_no_findings(correct_capture):
    diagnosis = examine(correct_capture, ExamineOptions(config=_DEMO, device="cpu"))

    assert diagnosis.findings == ()
    assert diagnosis.layout.startswith("N3DV")
    assert (len(diagnosis.capture.cameras), diagnosis.capture.frame_count) == (7, 15)


@pytest.mark.parametrize(
    "variant", [thorough("fast"), thorough("visitor"), thorough("mixed-cameras"), "dark-stage"]
)
def test_an_honest_variant_has_no_findings(tmp_path, variant):
    options = SynthOptions(128, 96, frames=9, cameras=6, variant=variant)
    write_synthetic_capture(tmp_path / "room", options)

    assert find_faults(tmp_path / "room") == ()


def test_exposures_that_change_over_time_are_found(tmp_path):
    options = SynthOptions(64, 48, frames=9, cameras=5, variant="auto-exposure")
    write_synthetic_capture(tmp_path / "room", options)

    assert [finding.kind for finding in find_faults(tmp_path / "room")] == ["exposure-changes"]


def test_very_wide_pictures_can_be_examined(tmp_path):
    write_synthetic_capture(tmp_path / "room", SynthOptions(1920, 16, frames=2, cameras=3))

    assert examine(tmp_path / "room", ExamineOptions(config=_DEMO, device="cpu")).forecast


def test_a_correct_capture_of_one_moment_has_no_findings(correct_capture):
    assert find_faults(correct_capture, capture_options=CaptureOptions(max_frames=1)) == ()


@pytest.mark.capture
def test_a_real_capture_has_no_findings(real_capture):
    assert find_faults(real_capture, capture_options=CaptureOptions(max_frames=20)) == ()


@pytest.mark.capture
def test_a_real_capture_of_one_moment_has_no_findings():
    folder = Path(os.environ.get("QUARC_STILL_CAPTURE", _STILL_CAPTURE))
    if not folder.is_dir():
        pytest.skip("no real capture: set QUARC_STILL_CAPTURE to a folder in N3DV's layout")
    assert find_faults(folder) == ()


@pytest.mark.parametrize("plant", FAULTS, ids=lambda plant: plant.__name__)
def test_a_planted_fault_is_named(folder, plant):
    plant(folder)
    findings = find_faults(folder)
    kind, cameras = FAULTS[plant]

    (finding,) = (finding for finding in findings if finding.kind == kind)
    assert finding.cameras == cameras
    assert not cameras or cameras[0] in finding.message


def test_ignored_frames_are_not_examined(folder):
    damage_frame(folder)
    (finding,) = find_faults(folder)
    assert f"{CAMERA} has unreadable frames (3, 4, 5" in finding.message
    assert f'add "ignored_frames": {{"{CAMERA}": [[3, 14]]}} to' in finding.message

    (folder / "quarc-capture.json").write_text(f'{{"ignored_frames": {{"{CAMERA}": [[3, null]]}}}}')
    assert find_faults(folder) == ()


def test_the_suggested_frames_do_not_depend_on_start(folder):
    repeat_frames(folder)
    options = CaptureOptions(start=2)
    (finding,) = (f for f in find_faults(folder) if f.kind == "repeated-frames")
    (from_start,) = (
        f for f in find_faults(folder, capture_options=options) if f.kind == "repeated-frames"
    )

    assert from_start == finding
    (folder / "quarc-capture.json").write_text(
        "{" + finding.message.split("add ")[1].split(" to ")[0] + "}"
    )
    assert find_faults(folder, capture_options=options) == ()


def test_insufficient_memory_and_disk_are_reported(correct_capture, monkeypatch):
    monkeypatch.setattr(doctor, "measure_free_resources", lambda: FreeResources(1 << 20, 1 << 20))
    memory, disk = find_faults(correct_capture, quick=True)

    assert (memory.kind, disk.kind) == ("memory-short", "disk-short")
    assert "0.0 GiB are free: use --downscale 2" in memory.message


def test_a_quick_check_reads_only_the_first_frame(folder):
    damage_frame(folder)

    assert find_faults(folder, quick=True) == ()


def test_the_reported_offset_repairs_the_capture(folder):
    delay_video(folder)
    (finding,) = (finding for finding in find_faults(folder) if finding.kind == "out-of-sync")
    assert f'change its offset to -3 ("offsets": {{"{CAMERA}": -3}})' in finding.message

    (folder / "quarc-capture.json").write_text(f'{{"offsets": {{"{CAMERA}": -3}}}}')
    assert find_faults(folder) == ()


def test_the_reported_offset_includes_that_of_the_capture(folder):
    (folder / "quarc-capture.json").write_text(f'{{"offsets": {{"{CAMERA}": 3}}}}')
    (finding,) = (finding for finding in find_faults(folder) if finding.kind == "out-of-sync")

    assert "3 frames early: in" in finding.message
    assert "change its offset to 0 " in finding.message


@pytest.mark.parametrize(("count", "frames"), [(1, "0"), (2, "[0, 1]")])
def test_black_frames_at_the_beginning_have_one_finding_whose_remedy_works(folder, count, frames):
    begin_with_black(folder, count=count)
    (quick_finding,) = find_faults(folder, quick=True)
    (finding,) = find_faults(folder)

    assert (quick_finding.kind, quick_finding.cameras) == ("camera-covered", (CAMERA,))
    assert "shows nothing in frame 0" in quick_finding.message
    assert (finding.kind, finding.cameras) == ("camera-covered", (CAMERA,))
    ignored = f'"ignored_frames": {{"{CAMERA}": [{frames}]}}'
    assert f"add {ignored} to" in finding.message

    (folder / "quarc-capture.json").write_text(f"{{{ignored}}}")
    assert find_faults(folder) == ()


def test_black_frames_at_the_beginning_of_all_videos_have_one_finding(folder):
    for path in folder.glob("*.mp4"):
        begin_with_black(folder, path.stem)
    (finding,) = find_faults(folder)

    assert finding.kind == "blank-first-frame"
    assert "off the beginning of all videos" in finding.message


def test_a_camera_that_never_shows_anything_is_to_be_ignored_to_the_end(folder):
    begin_with_black(folder, count=15)
    (finding,) = find_faults(folder)

    assert (finding.kind, finding.cameras) == ("camera-covered", (CAMERA,))
    assert f'add "ignored_frames": {{"{CAMERA}": [[0, null]]}} to' in finding.message
