"""Converts the canonical scene to other formats, SPZ and SOG, through PLY and back.

PlayCanvas's splat-transform, a program from npm, does the conversions; its output is rendered like
the stream's own frames.
"""

import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.export.gaussian_ply import build_ply, parse_ply

PACKAGE = "@playcanvas/splat-transform@3.7.0"
_SECONDS = 600
_SPZ_MAGIC = b"NGSP"


class UnavailableError(Exception):
    """An external program is not installed, or fails."""


@dataclass(frozen=True, slots=True, eq=False)
class Converted:
    """A scene after conversion to another format and back.

    Attributes:
        byte_count: Size of the file in that format.
        label: Name of the format, with its version if the file states it.
        splats: Contents of the file.
    """

    byte_count: int
    label: str
    splats: Splats


def convert_scene(splats: Splats, ending: str, folder: Path) -> Converted:
    """Write a scene in another format and read it back.

    Args:
        splats: The scene.
        ending: `spz` or `sog`.
        folder: Folder of programs and files.

    Raises:
        UnavailableError: The program cannot be installed, or fails.
    """
    program = install(folder / "node")
    with TemporaryDirectory(dir=folder) as beside:
        source, coded, back = (
            Path(beside, f"scene.{kind}") for kind in ("ply", ending, "back.ply")
        )
        source.write_bytes(build_ply(splats))
        for step in ((source, coded), (coded, back)):
            _run([program, "-q", "-g", "cpu", *step])
        data = coded.read_bytes()
        label = name_spz(data) if ending == "spz" else ending.upper()
        return Converted(len(data), label, parse_ply(back.read_bytes()))


def install(folder: Path) -> Path:
    """Return the program; install it into a folder with npm if it is missing.

    Raises:
        UnavailableError: Node or npm is missing, or npm fails.
    """
    program = folder / "node_modules" / ".bin" / "splat-transform"
    if program.exists():
        return program
    npm = shutil.which("npm")
    if npm is None:
        message = "npm is not installed"
        raise UnavailableError(message)
    folder.mkdir(parents=True, exist_ok=True)
    _run([npm, "install", "--no-audit", "--no-fund", "--prefix", folder, PACKAGE])
    return program


def read_program_version(folder: Path) -> str | None:
    """Return the version that the program prints; None if it is not installed."""
    program = folder / "node" / "node_modules" / ".bin" / "splat-transform"
    return _run([program, "--version"]).strip() if program.exists() else None


def name_spz(data: bytes) -> str:
    """Return `SPZ v` and the version stated in a file."""
    if data[:4] == _SPZ_MAGIC:
        return f"SPZ v{int.from_bytes(data[4:8], 'little')}"
    return "SPZ, gzipped, v3 or older"


def _run(command: list[str | Path]) -> str:
    name = Path(command[0]).name
    environment = {**os.environ, "npm_config_loglevel": "error"}
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=_SECONDS, check=True, env=environment
        )
    except (OSError, subprocess.SubprocessError) as error:
        reported = (getattr(error, "stderr", None) or str(error)).strip()
        message = f"{name}: {reported.splitlines()[-1] if reported else error}"
        raise UnavailableError(message) from error
    return done.stdout
