"""Every verb of the command, with the preparations for tests under stress."""

import os
import shlex
import subprocess
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.cli.commands import TINY_OPTIONS

_PUSH = "quarc_ref.streams.decode_stream.StreamDecoder.push"
_WRITE = "quarc_ref.streams.stream_writer.StreamWriter.write"
_WRITE_FRAME = "quarc_ref.files.OutputFolder.write"
_PLY = shlex.quote(str(Path(__file__).parents[1] / "hostile/seeds/gaussians/degree-1.ply"))
_TINY = shlex.join(TINY_OPTIONS)


@dataclass(frozen=True)
class Verb:
    """Input and output of a verb.

    Attributes:
        line: Its arguments; `{stream}`, `{encoded}`, `{capture}` and `{recordings}` stand for
            inputs, `{out}` for the output.
        makes: "file", "folder", or nothing.
        middle: Function that is called in the middle of its work.
        leaves: Names that may remain next to the target, for resuming.
        needs: A package that it requires.
    """

    line: str
    makes: str | None
    middle: str
    leaves: tuple[str, ...] = ()
    needs: str = "numpy"

    @property
    def reads(self) -> list[str]:
        """Names of its inputs."""
        return [name for name in ("stream", "encoded", "capture") if f"{{{name}}}" in self.line]

    def fill(self, places: dict[str, object]) -> list[str]:
        """Return the arguments."""
        return [word.format(**places) for word in shlex.split(self.line)]


VERBS = {
    "calibrate": Verb(
        "{recordings} -o {out} --sync none --moments 1",
        "folder",
        "quarc_ref.calibration.features.Features._extract",
        needs="pycolmap",
    ),
    "encode": Verb(
        f"{{capture}} -o {{out}} --frames 2 {_TINY}",
        "file",
        _WRITE,
        leaves=("out.part", "out.part.training"),
    ),
    "import": Verb(f"{_PLY} -o {{out}}", "file", _WRITE),
    "doctor": Verb("{capture}", None, "quarc_ref.encoder.checks.recording._downscale"),
    "decode": Verb("{stream} -o {out}", "folder", _WRITE_FRAME),
    "verify": Verb("{stream}", None, _PUSH),
    "info": Verb("{stream}", None, _PUSH),
    "inspect": Verb("{stream}", None, _PUSH),
    "cut": Verb("{stream} --frames : -o {out}", "file", _WRITE),
    "join": Verb("{stream} {stream} -o {out}", "file", _WRITE),
    "edit": Verb("{stream} --drop 0,0,0,0.01 -o {out}", "file", _WRITE),
    "view": Verb("{stream} --no-open", None, "socketserver.BaseServer.service_actions"),
    "publish": Verb(
        "{stream} -o {out}", "folder", "quarc_ref.streams.chunk_reader.ChunkReader.take"
    ),
    "render": Verb("{stream} --to png -o {out}", "folder", _WRITE_FRAME),
    "bench": Verb("{stream}", None, _PUSH),
    "eval": Verb("{encoded} {capture} --report {out}", "folder", _PUSH),
    "compare": Verb(
        "{encoded} {encoded} --capture {capture} --report {out}",
        "folder",
        _PUSH,
        needs="bjontegaard",
    ),
    "synth": Verb(
        "{out} --width 16 --height 16 --frames 1",
        "folder",
        "quarc_ref.synth.write_capture.write_video",
    ),
    "demo": Verb(
        f"-o {{out}} --frames 2 {_TINY}",
        "folder",
        "quarc_ref.synth.write_capture.write_video",
    ),
}
OUTPUT_VERBS = [name for name, verb in VERBS.items() if verb.makes]
INPUTS_BY_VERB = [(name, what) for name, verb in VERBS.items() for what in verb.reads]


@contextmanager
def mount_small_disk(folder: Path, options: str):
    """Mount a small file system in a folder; skips if that is not permitted."""
    mount = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)]
    try:
        completed = subprocess.run(mount, capture_output=True, text=True, check=False)
    except OSError as error:
        pytest.skip(f"no disk can be mounted here: {error}")
    if completed.returncode:
        pytest.skip(f"no disk can be mounted here: {completed.stderr.strip()}")
    try:
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


@contextmanager
def readonly_folder(folder: Path):
    """A folder in which nothing can be created, not even by the superuser."""
    if os.geteuid() == 0:
        with mount_small_disk(folder, "ro"):
            yield folder
        return
    folder.chmod(0o555)
    try:
        yield folder
    finally:
        folder.chmod(0o755)


def fill_up(folder: Path) -> None:
    """Fill a disk completely."""
    with (folder / "filler").open("wb", buffering=0) as file:
        try:
            while file.write(bytes(4096)):
                pass
        except OSError:
            return


@contextmanager
def drop_privileges():
    """Give up the superuser's right to read all files."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(0)
