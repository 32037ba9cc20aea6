from dataclasses import replace
from pathlib import Path

import pytest

from quarc_ref.encoder.description import describe_encode
from quarc_ref.format.errors import ResumeError
from rate import jobs
from rate.jobs import Job, encode_if_missing, list_differences
from tests.encoder.toys import make_capture

JOB = Job(Path("captures/plane"), "main")


def test_every_difference_between_jobs_is_in_the_name():
    different_jobs = [
        JOB,
        replace(JOB, capture=Path("captures/other")),
        replace(JOB, preset="paper"),
        replace(JOB, changes=(("seed", "1"),)),
        replace(JOB, changes=(("seed", "2"),)),
        replace(JOB, frames=3),
        replace(JOB, downscale=2),
        replace(JOB, held_out=("cam03",)),
        replace(JOB, held_out=("cam03", "cam12")),
    ]

    assert JOB.file_name() == "plane.main.quarc"
    assert len({job.file_name() for job in different_jobs}) == len(different_jobs)


def test_many_changes_give_a_valid_file_name():
    changes = tuple((f"motion.setting_{number}", "0.125") for number in range(20))
    different_jobs = [replace(JOB, changes=changes), replace(JOB, changes=changes[:-1])]
    names = [job.file_name() for job in different_jobs]

    assert names[0] != names[1]
    for name in names:
        assert name.startswith("plane.main.motion.setting_0=0.125.")
        assert name.endswith(".quarc")
        assert len(f".{name}.psnr.json.0123456789abcdef.part") < 255


def test_changes_are_applied_to_the_settings():
    config = replace(JOB, changes=(("motion.lr", "0.5"), ("seed", "7"))).make_config()

    assert (config.motion.lr, config.seed) == (0.5, 7)


def _describe_job(job):
    return describe_encode(make_capture(), job.make_config(), "cpu")


@pytest.mark.parametrize("preset", ["main", "paper"])
def test_a_stream_made_with_these_settings_has_no_differences(preset):
    job = replace(JOB, preset=preset)

    assert list_differences(job, _describe_job(job)) == []


def test_a_stream_made_with_other_settings_is_detected():
    other_job = replace(JOB, changes=(("motion.lr", "0.5"), ("births.split_iters", "3,4")))

    assert list_differences(JOB, _describe_job(other_job)) == ["births.split_iters", "motion.lr"]
    assert list_differences(JOB, {}) == []


def test_an_existing_stream_is_reused(tmp_path):
    (tmp_path / "plane.main.quarc").write_bytes(b"a stream")

    assert encode_if_missing(JOB, tmp_path) == b"a stream"


def test_a_stream_that_cannot_be_resumed_is_named(tmp_path, monkeypatch):
    def reject(*_):
        message = "other settings"
        raise ResumeError(message)

    monkeypatch.setattr(jobs, "open_capture", lambda *_: make_capture())
    monkeypatch.setattr(jobs, "encode_file", reject)

    with pytest.raises(ResumeError, match=r"other settings; remove .*plane\.main\.quarc\.part"):
        encode_if_missing(JOB, tmp_path)
