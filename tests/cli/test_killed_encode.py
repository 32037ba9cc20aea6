"""An encode killed at any moment can be resumed to the same file.

Three moments by default; QUARC_KILLS=20 tests twenty.
"""

import os
import random
import time
from contextlib import suppress

import pytest

from tests.cli.commands import TINY, run
from tests.cli.processes import start
from tests.datasets import scenes

_FRAMES = 8
_KILLS = int(os.environ.get("QUARC_KILLS", "3"))
_SETTINGS = TINY | {
    "canonical.iterations": 40,
    "canonical.exposure_from_iter": 5,
    "canonical.prune_rd_lambda": 0,
    "motion.iterations": 8,
    "births.iterations": 5,
    "births.error_threshold": 0.02,
    "target_kb_per_frame": 0.3,
}
_OPTIONS = [part for key, value in _SETTINGS.items() for part in ("--set", f"{key}={value}")]


@pytest.fixture(scope="module")
def reference_encode(tmp_path_factory):
    """The arguments of an encode without its file, and its bytes.

    Also how many seconds it takes after its part exists, and after frame 0 is in it.
    """
    folder = tmp_path_factory.mktemp("killed")
    capture = scenes.write_n3dv(
        folder / "plane", scenes.make_shots(), _FRAMES, scenes.make_plane_points()
    )
    command = ["encode", capture, *_OPTIONS, "-q", "-o"]
    file = folder / "whole.quarc"
    with start(*command, file) as encoding:
        moments = [_wait_for_part(file, holds_frames) for holds_frames in (False, True)]
        encoding.wait()
        end = time.monotonic()
    assert encoding.returncode == 0
    return command, file.read_bytes(), [end - moment for moment in moments]


def _wait_for_part(file, holds_frames):
    """Return when the part of a file exists, optionally with frames."""
    for _ in range(12_000):
        with suppress(FileNotFoundError):  # the part has the name of the file
            if file.exists() or file.with_name(file.name + ".part").stat().st_size >= holds_frames:
                return time.monotonic()
        time.sleep(0.01)
    return pytest.fail("nothing is written for two minutes")


@pytest.mark.parametrize("seed", range(_KILLS))
def test_a_killed_encode_is_resumed_to_the_same_file(seed, reference_encode, tmp_path):
    command, whole, seconds = reference_encode
    file, part = tmp_path / "a.quarc", tmp_path / "a.quarc.part"
    holds_frames = seed % 3 > 0  # usually every third is killed during the training of frame 0
    with start(*command, file) as encoding:
        _wait_for_part(file, holds_frames)
        time.sleep(random.Random(seed).uniform(0, seconds[holds_frames]))
        encoding.kill()
    partial_data = part.read_bytes() if part.exists() else file.read_bytes()

    assert file.exists() != part.exists()
    assert whole.startswith(partial_data)
    assert run(*command, file, "--resume").exit_code == 0
    assert file.read_bytes() == whole
    assert [path.name for path in tmp_path.iterdir()] == ["a.quarc"]
