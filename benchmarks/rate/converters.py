"""The canonical scene in other programs' formats: SPZ and SOG, by way of PLY and back.

PlayCanvas's splat-transform, a program of npm, does the conversions; what it
gives back is drawn by the renderer that draws the stream's own frames.
"""

import os
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.export.gaussian_ply import build_ply

PACKAGE = "@playcanvas/splat-transform@3.7.0"
_SECONDS = 600
_PLY = re.compile(rb"ply\r?\nformat binary_little_endian 1\.0\r?\n(.*?)end_header\r?\n", re.DOTALL)
_VERTEX = re.compile(rb"element vertex (\d+)\r?\n((?:property float \S+\r?\n)+)\Z")
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


def parse_ply(data: bytes) -> Splats:
    """Return the scene of a 3DGS PLY; of its SH, no more than degree 1.

    Args:
        data: Binary, little-endian, vertices alone, all properties float, as
            `build_ply` and splat-transform write it.

    Raises:
        ValueError: It is no such file.
    """
    columns = _read_columns(data)

    def stack(*names: str) -> np.ndarray:
        return np.stack([columns[name] for name in names], axis=1)

    rest = sum(name.startswith("f_rest_") for name in columns) // 3
    sh = [stack("f_dc_0", "f_dc_1", "f_dc_2")]
    sh += [
        stack(*(f"f_rest_{color * rest + coefficient}" for color in range(3)))
        for coefficient in range(min(rest, 3))
    ]
    rotations = stack("rot_0", "rot_1", "rot_2", "rot_3")
    return Splats(
        stack("x", "y", "z"),
        rotations / np.linalg.norm(rotations, axis=1, keepdims=True),
        stack("scale_0", "scale_1", "scale_2"),
        columns["opacity"],
        np.stack(sh, axis=1),
    )


def _read_columns(data: bytes) -> dict[str, np.ndarray]:
    head = _PLY.match(data)
    body = head and _VERTEX.search(
        b"".join(
            line + b"\n"
            for line in head[1].splitlines()
            if not line.startswith((b"comment", b"obj_info"))
        )
    )
    if head is None or body is None:
        message = "not a binary little-endian PLY of vertices with float properties"
        raise ValueError(message)
    names = [line.split()[2].decode() for line in body[2].splitlines()]
    table = np.frombuffer(data[head.end() :], dtype="<f4")
    if table.size != int(body[1]) * len(names):
        message = f"{table.size} numbers are not {int(body[1])} rows of {len(names)}"
        raise ValueError(message)
    return dict(zip(names, table.reshape(-1, len(names)).T.astype(np.float32), strict=True))


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
