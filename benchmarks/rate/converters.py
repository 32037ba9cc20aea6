"""The canonical scene in other programs' formats: SPZ and SOG, by way of PLY and back.

PlayCanvas's splat-transform, a program of npm, does the conversions; what it
gives back is drawn by the renderer that draws the stream's own frames.
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


class NotAtHandError(Exception):
    """A program that others wrote is not here, or did not do its work."""


@dataclass(frozen=True, slots=True, eq=False)
class Converted:
    """A scene after a way through another format.

    Attributes:
        byte_count: The file of that format.
        label: The format, and its version where the bytes tell it.
        splats: What is read from the file.
    """

    byte_count: int
    label: str
    splats: Splats


def convert_scene(splats: Splats, ending: str, folder: Path) -> Converted:
    """Write a scene in another format and read it back.

    Args:
        splats: The scene.
        ending: `spz` or `sog`.
        folder: Where programs and files are kept.

    Raises:
        NotAtHandError: The program is not here and cannot be installed, or fails.
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
    """Return the program, put into a folder by npm if it is not there.

    Raises:
        NotAtHandError: There is no Node or npm, or npm fails.
    """
    program = folder / "node_modules" / ".bin" / "splat-transform"
    if program.exists():
        return program
    npm = shutil.which("npm")
    if npm is None:
        message = "npm is not installed"
        raise NotAtHandError(message)
    folder.mkdir(parents=True, exist_ok=True)
    _run([npm, "install", "--no-audit", "--no-fund", "--prefix", folder, PACKAGE])
    return program


def tell_version(folder: Path) -> str | None:
    """Return what the program says of its version; None where it is not installed."""
    program = folder / "node" / "node_modules" / ".bin" / "splat-transform"
    return _run([program, "--version"]).strip() if program.exists() else None


def name_spz(data: bytes) -> str:
    """Return `SPZ v` and the version that a file's own bytes tell."""
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
        told = (getattr(error, "stderr", None) or str(error)).strip()
        message = f"{name}: {told.splitlines()[-1] if told else error}"
        raise NotAtHandError(message) from error
    return done.stdout
