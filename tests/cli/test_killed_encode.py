"""Tests that a killed encode can be resumed and results in the same file.

An encode is killed at a random time. With --thorough, this happens three times; the environment
variable QUARC_KILLS sets that number.
"""

import os
import random
import time
from contextlib import suppress

import pytest

from tests.cli.commands import TINY, run
from tests.cli.processes import start
from tests.datasets import scenes

_FRAME_COUNT = 8
_KILL_COUNT = int(os.environ.get("QUARC_KILLS", "3"))
_SETTINGS = TINY | {
    "canonical.iterations": 40,
    "canonical.exposure_from_iter": 5,
    "canonical.prune_rd_lambda": 0,
    "motion.iterations": 8,
    "births.iterations": 5,
    "births.error_threshold": 0.02,
    "target_kb_per_frame": 0.3,
}
_OPTIONS = [
    argument for key, value in _SETTINGS.items() for argument in ("--set", f"{key}={value}")
]


_PROGRAM_WITHOUT_COMPILER = """
import sys
sys.modules["torch._dynamo"] = None
from quarc_ref.__main__ import main
main()
"""


@pytest.fixture(scope="module")
def reference_encode(tmp_path_factory):
    """Command line, bytes and durations of an uninterrupted encode.

    The command line ends before the output path. The durations are the seconds to the end, first
    from the creation of the partial stream, then from the time at which it contains frame 0.
    The encode fails if it imports torch's compiler, which takes seconds.
    """
    folder = tmp_path_factory.mktemp("killed")
    capture = scenes.write_n3dv(
        folder / "plane", scenes.make_shots(), _FRAME_COUNT, scenes.make_plane_points()
    )
    command = ["encode", capture, *_OPTIONS, "-q", "-o"]
    file = folder / "whole.quarc"
    with start(*command, file, program=_PROGRAM_WITHOUT_COMPILER) as process:
        times = [_wait_for_part(file, holds_frames) for holds_frames in (False, True)]
        process.wait()
        end_time = time.monotonic()
    assert process.returncode == 0
    return command, file.read_bytes(), [end_time - part_time for part_time in times]


def _wait_for_part(file, holds_frames):
    """Wait for the partial stream of a file, and optionally for frame 0; return the time."""
    for _ in range(12_000):
        with suppress(FileNotFoundError):  # the partial stream has just been renamed to the file
            if file.exists() or file.with_name(file.name + ".part").stat().st_size >= holds_frames:
                return time.monotonic()
        time.sleep(0.01)
    return pytest.fail("nothing is written for two minutes")


@pytest.mark.parametrize(
    "seed",
    [0, *(pytest.param(seed, marks=pytest.mark.thorough) for seed in range(1, _KILL_COUNT))],
)
def test_a_killed_encode_is_resumed_to_the_same_file(seed, reference_encode, tmp_path):
    command, expected_data, seconds = reference_encode
    file, part = tmp_path / "a.quarc", tmp_path / "a.quarc.part"
    holds_frames = (
        seed % 3 > 0
    )  # a third of the encodes can be killed during the training of frame 0
    with start(*command, file) as process:
        _wait_for_part(file, holds_frames)
        time.sleep(random.Random(seed).uniform(0, seconds[holds_frames]))
        process.kill()
    partial_data = part.read_bytes() if part.exists() else file.read_bytes()

    assert file.exists() != part.exists()
    assert expected_data.startswith(partial_data)
    assert run(*command, file, "--resume").exit_code == 0
    assert file.read_bytes() == expected_data
    assert [path.name for path in tmp_path.iterdir()] == ["a.quarc"]
