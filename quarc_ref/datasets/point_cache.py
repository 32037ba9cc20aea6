"""Caches triangulated points, so that opening a capture again is fast.

Triangulation takes ten seconds or more. The user's cache directory (`~/.cache/quarc-ref/points` on
Linux) has one PLY file per combination of capture, training cameras and version of the
triangulation code. It is safe to delete the cached files.
"""

import hashlib
import json
import logging
from collections.abc import Callable, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import platformdirs

from quarc_ref.datasets.capture import Points
from quarc_ref.datasets.errors import CaptureError
from quarc_ref.datasets.points_ply import read_points_ply, write_points_ply
from quarc_ref.files import OutputPathError

_LOG = logging.getLogger(__name__)
_CODE_FILES = ("triangulation.py", "dense_points.py", "plane_sweep.py", "undistortion.py")


def load_or_compute_points(key: str, compute_points: Callable[[], Points]) -> Points:
    """Return the cached points for a key; if there are none, triangulate and cache them.

    Args:
        key: Cache key from `make_cache_key`.
        compute_points: Function that triangulates the points.
    """
    path = platformdirs.user_cache_path("quarc-ref") / "points" / f"{key}.ply"
    try:
        points = read_points_ply(path)
    except CaptureError:  # not cached yet, or damaged
        _LOG.info(
            "the capture has no initial points: triangulating them, and saving them to %s", path
        )
        points = compute_points()
        _save_points(path, points)
    else:
        _LOG.info("using initial points that were triangulated earlier: %s", path)
    return points


def make_cache_key(fingerprint: str, start: int, downscale: int, cameras: Sequence[str]) -> str:
    """Return a cache key that depends on all inputs of the triangulation and on its code.

    Args:
        fingerprint: Fingerprint of the capture.
        start: Frame of the synchronized recording whose pictures are used.
        downscale: Factor by which pictures are downscaled.
        cameras: Names of the cameras whose pictures are used.
    """
    code = [(Path(__file__).parent / name).read_text("utf-8") for name in _CODE_FILES]
    parts = [fingerprint, start, downscale, list(cameras), _find_colmap_version(), code]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:32]


def _find_colmap_version() -> str | None:
    try:
        return version("pycolmap")
    except PackageNotFoundError:  # then nothing is triangulated
        return None


def _save_points(path: Path, points: Points) -> None:
    """Write points to a file; log a warning if the file cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_points_ply(path, points)
    except (OSError, OutputPathError) as error:
        _LOG.warning("the initial points cannot be saved: %s", error)
