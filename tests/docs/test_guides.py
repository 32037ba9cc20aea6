"""The guides work: their commands are run as written, on small captures."""

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.commands import TINY_OPTIONS, run
from tests.datasets import scenes
from tests.docs.pages import ROOT, find_fences
from tests.recordings import write_recordings

pytestmark = pytest.mark.thorough

TINY = shlex.join(TINY_OPTIONS)
# Only the training is shortened, by settings at the end of a command.
PREAMBLE = f"""
set -e
quarc-ref() {{
  case $1 in
    encode) {shlex.quote(sys.executable)} -m quarc_ref "$@" {TINY} --frames $FRAMES --no-checks ;;
    *) {shlex.quote(sys.executable)} -m quarc_ref "$@" ;;
  esac
}}
python() {{
  case $1 in
    benchmarks/paper.py)
      {shlex.quote(sys.executable)} {ROOT}/"$@" {TINY} --frames $FRAMES --only full ;;
    *) (cd {ROOT} && {shlex.quote(sys.executable)} "$@") ;;
  esac
}}
"""


def follow(guide: str, folder: Path, frames: int = 2) -> None:
    """Run all commands of a guide in a folder; a failing command is shown with its output."""
    script = PREAMBLE + "".join(find_fences(ROOT / "docs" / "guides" / guide))
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    environment = os.environ | {"PATH": path, "PYTHONPATH": str(ROOT), "FRAMES": str(frames)}
    done = subprocess.run(
        ["bash", "-c", script], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]


@pytest.fixture
def capture(tmp_path):
    """A capture of four cameras, 48 x 32, three frames, in N3DV's layout."""
    folder = tmp_path / "capture"
    return scenes.write_n3dv(folder, scenes.make_shots(), 3, scenes.make_plane_points())


def test_from_cameras_to_a_page(tmp_path):
    write_recordings(tmp_path / "videos")

    follow("cameras-to-page.md", tmp_path, frames=1)

    assert (tmp_path / "capture" / "calibration.html").exists()
    assert (tmp_path / "site" / "index.html").exists()


def test_your_method_against_ours(tmp_path, capture):
    stream = tmp_path / "other.quarc"
    made = run("encode", capture, "-o", stream, "--frames", "2", *TINY_OPTIONS)
    assert made.exit_code == 0, made.stderr
    assert run("decode", stream, "-o", tmp_path / "plys", "--to", "ply").exit_code == 0
    (tmp_path / "plys" / "sequence.json").unlink()  # other methods do not write it

    follow("your-method.md", tmp_path)

    assert (tmp_path / "side" / "index.html").exists()
    assert (tmp_path / "theirs.quarc").stat().st_size > 0


def test_the_papers_table(tmp_path):
    (tmp_path / "N3DV").mkdir()
    for name in ("plane", "same"):
        folder = tmp_path / "N3DV" / name
        scenes.write_n3dv(folder, scenes.make_shots(), 3, scenes.make_plane_points())

    follow("paper-table.md", tmp_path)

    assert (tmp_path / "paper" / "N3DV" / "plane" / "index.html").exists()
    assert (tmp_path / "paper" / "scenes.csv").exists()
    assert "| mean |" in (tmp_path / "paper" / "scenes.md").read_text()


def test_writing_a_decoder(tmp_path):
    follow("decoder.md", tmp_path)
