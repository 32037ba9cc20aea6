"""Converts the canonical scene to SPZ or SOG and back, with PLY as the intermediate format.

The conversions are done by splat-transform from PlayCanvas, which is installed with npm. The scene
that was converted back is rendered like the decoded frames of a stream.
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
_TIMEOUT_SECONDS = 600
_SPZ_MAGIC = b"NGSP"


class UnavailableError(Exception):
    """An external program is not installed, or has failed."""


@dataclass(frozen=True, slots=True, eq=False)
class RoundTripScene:
    """A scene that was converted to another format and back.

    Attributes:
        byte_count: Size of the file in the other format.
        label: Name of the format, with its version if the file states it.
        splats: The scene that was converted back.
    """

    byte_count: int
    label: str
    splats: Splats


def convert_and_restore(splats: Splats, format_name: str, folder: Path) -> RoundTripScene:
    """Convert a scene to another format and back.

    Args:
        splats: Scene to convert.
        format_name: `spz` or `sog`.
        folder: Folder for the program and temporary files.

    Raises:
        UnavailableError: The program cannot be installed, or it fails.
    """
    program = install_splat_transform(folder / "node")
    with TemporaryDirectory(dir=folder) as temporary_folder:
        source_path, encoded_path, decoded_path = (
            Path(temporary_folder, f"scene.{suffix}") for suffix in ("ply", format_name, "back.ply")
        )
        source_path.write_bytes(build_ply(splats))
        for paths in ((source_path, encoded_path), (encoded_path, decoded_path)):
            _run_program([program, "-q", "-g", "cpu", *paths])
        data = encoded_path.read_bytes()
        label = describe_spz(data) if format_name == "spz" else format_name.upper()
        return RoundTripScene(len(data), label, parse_ply(decoded_path.read_bytes()))


def install_splat_transform(folder: Path) -> Path:
    """Return the path of splat-transform; if it is missing, install it with npm into `folder`.

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
    _run_program([npm, "install", "--no-audit", "--no-fund", "--prefix", folder, PACKAGE])
    return program


def read_splat_transform_version(folder: Path) -> str | None:
    """Return the version that splat-transform prints; None if it is not installed."""
    program = folder / "node" / "node_modules" / ".bin" / "splat-transform"
    return _run_program([program, "--version"]).strip() if program.exists() else None


def describe_spz(data: bytes) -> str:
    """Return the name of the SPZ format with its version, which is read from the file."""
    if data[:4] == _SPZ_MAGIC:
        return f"SPZ v{int.from_bytes(data[4:8], 'little')}"
    return "SPZ, gzipped, v3 or older"


def _run_program(command: list[str | Path]) -> str:
    name = Path(command[0]).name
    environment = {**os.environ, "npm_config_loglevel": "error"}
    try:
        process = subprocess.run(
            command,
            capture_output=True,
            text=True,
            timeout=_TIMEOUT_SECONDS,
            check=True,
            env=environment,
        )
    except (OSError, subprocess.SubprocessError) as error:
        error_text = (getattr(error, "stderr", None) or str(error)).strip()
        message = f"{name}: {error_text.splitlines()[-1] if error_text else error}"
        raise UnavailableError(message) from error
    return process.stdout
