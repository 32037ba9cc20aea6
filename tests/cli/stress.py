"""A table of all verbs, and faults for tests: full disks, read-only folders, missing rights."""

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
_TINY_ARGUMENTS = shlex.join(TINY_OPTIONS)


@dataclass(frozen=True)
class Verb:
    """How a test calls a verb, and what the verb writes.

    Attributes:
        line: Arguments of the verb; `{stream}`, `{encoded}`, `{capture}` and `{recordings}` stand
            for inputs, `{out}` for the output.
        output_kind: "file" or "folder"; None if the verb writes neither.
        interrupted_function: Dotted name of a function that the verb calls repeatedly.
        leftover_names: Names that an interrupted verb may leave next to the target for resuming.
        required_package: Package without which the test is skipped.
    """

    line: str
    output_kind: str | None
    interrupted_function: str
    leftover_names: tuple[str, ...] = ()
    required_package: str = "numpy"

    @property
    def input_names(self) -> list[str]:
        """Names of the inputs in the verb's arguments."""
        return [name for name in ("stream", "encoded", "capture") if f"{{{name}}}" in self.line]

    def fill_arguments(self, paths: dict[str, object]) -> list[str]:
        """Return the arguments with paths in place of names in braces."""
        return [argument.format(**paths) for argument in shlex.split(self.line)]


VERBS = {
    "calibrate": Verb(
        "{recordings} -o {out} --sync none --moments 1",
        "folder",
        "quarc_ref.calibration.features.Features._extract_features",
        required_package="pycolmap",
    ),
    "encode": Verb(
        f"{{capture}} -o {{out}} --frames 2 {_TINY_ARGUMENTS}",
        "file",
        _WRITE,
        leftover_names=("out.part", "out.part.training"),
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
        "a={encoded} b={encoded} --capture {capture} --report {out}",
        "folder",
        _PUSH,
        required_package="bjontegaard",
    ),
    "synth": Verb(
        "{out} --width 16 --height 16 --frames 1",
        "folder",
        "quarc_ref.synth.write_capture.write_video",
    ),
    "demo": Verb(
        f"-o {{out}} --frames 2 {_TINY_ARGUMENTS}",
        "folder",
        "quarc_ref.synth.write_capture.write_video",
    ),
}
OUTPUT_VERBS = [name for name, verb in VERBS.items() if verb.output_kind]
INPUTS_BY_VERB = [
    (name, input_name) for name, verb in VERBS.items() for input_name in verb.input_names
]


@contextmanager
def mount_small_disk(folder: Path, options: str):
    """Mount a small file system in a folder; skips the test if mounting is not permitted."""
    command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)]
    try:
        completed = subprocess.run(command, capture_output=True, text=True, check=False)
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
    """Make a folder read-only, even for the superuser, within the context."""
    if os.geteuid() == 0:
        with mount_small_disk(folder, "ro"):
            yield folder
        return
    folder.chmod(0o555)
    try:
        yield folder
    finally:
        folder.chmod(0o755)


def fill_disk(folder: Path) -> None:
    """Fill the disk of a folder completely."""
    with (folder / "filler").open("wb", buffering=0) as file:
        try:
            while file.write(bytes(4096)):
                pass
        except OSError:
            return


@contextmanager
def drop_privileges():
    """Run as an unprivileged user within the context."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(0)
