"""Gaussians of other methods as entries: a PLY file to each frame, or a `.4dgs` file."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quarc_ref.decoder import Splats
from quarc_ref.evaluation.comparison.entries import EntryError, Holdings, Label, SplatEntry
from quarc_ref.evaluation.comparison.numbered_files import number_files
from quarc_ref.export.activate import SH_BASE
from quarc_ref.export.gaussian_ply import parse_ply

_LEAST, _MOST = 1e-6, 1 - 1e-6  # opacities, so that they have a logit
_LEAST_SCALE = 1e-30


def open_plys(folder: Path, label: Label) -> SplatEntry:
    """Open a folder with a 3DGS PLY to each frame, or the PLY of one frame.

    Args:
        folder: Of the files; the last number in a file's name is the frame's ordinal.
        label: What it stands for.

    Raises:
        EntryError: Two files are of the same frame, or there is none.
        OSError: The folder cannot be read.
    """
    files = number_files([folder] if folder.is_file() else folder.glob("*.ply"), folder)
    total = sum(path.stat().st_size for path in files.values())
    holdings = Holdings("PLY per frame", tuple(files), total)
    return SplatEntry(label, holdings, lambda frame: _read_ply(files[frame]))


def open_fourdgs(path: Path, label: Label, frames_per_second: float) -> SplatEntry:
    """Open a `.4dgs` file.

    Args:
        path: Of the file.
        label: What it stands for.
        frames_per_second: Of the frames that it is compared at.

    Raises:
        EntryError: The file is malformed.
        ImportError: `fourdgs` is not installed.
        OSError: The file cannot be read.
    """
    data = path.read_bytes()
    duration, load = _read_fourdgs(data, path)
    count = max(1, math.floor(duration * frames_per_second + 0.5))
    holdings = Holdings("4dgs", tuple(range(count)), len(data))
    return SplatEntry(label, holdings, lambda frame: load(frame / frames_per_second))


def _read_ply(path: Path) -> Splats:
    try:
        return parse_ply(path.read_bytes())
    except ValueError as error:
        message = f"{path}: {error}"
        raise EntryError(message) from error


def _read_fourdgs(data: bytes, path: Path) -> tuple[float, Callable[[float], Splats]]:
    """Return how long a scene is, seconds, and what returns its Gaussians at a time."""
    import fourdgs
    from fourdgs.keyframe_delta_file import decode_streamed, render_at

    try:
        try:
            sequence = decode_streamed(data)
        except fourdgs.MalformedFile:  # of the other temporal model, or of none
            scene = fourdgs.read(data)
            return scene.duration_sec, lambda time: _take_state(scene, time)
    except fourdgs.FourdgsError as error:
        message = f"{path}: {error}"
        raise EntryError(message) from error
    return sequence.header.duration_sec, lambda time: _take_rendered(render_at(sequence, time))


def _take_rendered(found: Mapping[str, NDArray[Any]]) -> Splats:
    """Return the Gaussians of an instant of the model `keyframe-delta`, which has no SH."""
    sh = _to_base(found["rgb"])[:, None]
    return _build(found["centers"], found["rotations"], found["scales"], found["opacity"], sh)


def _take_state(scene: Any, time: float) -> Splats:  # noqa: ANN401, fourdgs has no types
    """Return the Gaussians of an instant of the model `gaussian-birth`."""
    from fourdgs.quantization import SH_QUANT_HI, SH_QUANT_LO

    state, kept = scene.state_at(time), scene.gaussians
    rows = state["indices"]
    sh = _to_base(kept.colors[rows, :3])[:, None]
    if kept.sh is not None:
        levels = kept.sh[rows].astype(np.float64) / 255
        rest = (SH_QUANT_LO + levels * (SH_QUANT_HI - SH_QUANT_LO)).reshape(len(rows), 3, -1)
        sh = np.concatenate([sh, rest.transpose(0, 2, 1)], axis=1)
    return _build(state["centers"], state["orientations"], kept.scales[rows], state["opacity"], sh)


def _to_base(colors: NDArray[Any]) -> NDArray[np.float64]:
    base: NDArray[np.float64] = (colors.astype(np.float64) - 0.5) / SH_BASE
    return base


def _build(
    centers: NDArray[Any],
    rotations: NDArray[Any],
    scales: NDArray[Any],
    opacities: NDArray[Any],
    sh: NDArray[np.float64],
) -> Splats:
    """Return Gaussians of activated numbers.

    Args:
        centers: `[N, 3]` world units.
        rotations: `[N, 4]` xyzw.
        scales: `[N, 3]` world units.
        opacities: `[N]` 0 to 1.
        sh: `[N, K, 3]`.
    """
    held = np.clip(opacities.astype(np.float64), _LEAST, _MOST)
    return Splats(
        np.ascontiguousarray(centers, dtype=np.float32),
        np.ascontiguousarray(np.roll(rotations, 1, axis=1), dtype=np.float32),
        np.log(np.maximum(scales.astype(np.float64), _LEAST_SCALE)).astype(np.float32),
        np.log(held / (1 - held)).astype(np.float32),
        np.ascontiguousarray(sh, dtype=np.float32),
    )
