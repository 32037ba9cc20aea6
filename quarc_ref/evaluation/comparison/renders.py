"""Entries from pictures that another renderer made.

The folder has PNG or JPEG files: `CAMERA/FRAME.png`, `FRAME/CAMERA.png`, or `FRAME.png`
for a single camera. The last number in a frame's name is its ordinal.
"""

from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np

from quarc_ref.datasets.video import read_still
from quarc_ref.evaluation.comparison.entries import Entry, EntryError, EntryInfo, Label
from quarc_ref.evaluation.comparison.numbered_files import number_files
from quarc_ref.evaluation.metrics import Picture
from quarc_ref.format.cameras import Camera

_SUFFIXES = (".png", ".jpg", ".jpeg")


def open_renders(
    folder: Path, label: Label, cameras: Collection[str], byte_count: int | None
) -> Entry:
    """Open a folder of pictures.

    Args:
        folder: Folder of the pictures.
        label: Method and operating point.
        cameras: Names of the cameras to compare on.
        byte_count: Size of the files that the pictures were made from; None if unknown.

    Raises:
        EntryError: The folder has none of these layouts, a camera is missing, or a frame
            is duplicated.
        OSError: The folder cannot be read.
    """
    files = _list_pictures(folder, cameras)
    common = set.intersection(*(set(frames) for frames in files.values()))
    return _Renders(label, EntryInfo("renders", tuple(sorted(common)), byte_count), files)


class _Renders(Entry):
    """Pictures on disk, by camera and frame."""

    def __init__(
        self, label: Label, info: EntryInfo, files: Mapping[str, Mapping[int, Path]]
    ) -> None:
        super().__init__(label, info)
        self._files = files

    def draw(self, frame: int, cameras: Mapping[str, Camera]) -> dict[str, Picture]:
        """See `Entry.draw`."""
        return {
            name: _read_picture(self._files[name][frame], camera)
            for name, camera in cameras.items()
        }


def _read_picture(path: Path, camera: Camera) -> Picture:
    levels = read_still(path, (camera.width, camera.height))
    picture: Picture = levels.astype(np.float32) / np.float32(255)
    return picture


def _list_pictures(folder: Path, cameras: Collection[str]) -> dict[str, dict[int, Path]]:
    """Return the pictures of each camera by frame."""
    flat = _find_pictures(folder)
    if flat and len(cameras) == 1:
        return {name: number_files(flat, folder) for name in cameras}
    inner = {each.name: _find_pictures(each) for each in folder.iterdir() if each.is_dir()}
    if not flat and set(cameras) <= set(inner):
        return {name: number_files(inner[name], folder / name) for name in cameras}
    stems = {path.stem for pictures in inner.values() for path in pictures}
    if not flat and set(cameras) <= stems:
        return {name: _list_by_frame(folder, inner, name) for name in cameras}
    wanted = ", ".join(sorted(cameras))
    message = (
        f"{folder} has no pictures of {wanted}: name them CAMERA/FRAME.png or "
        "FRAME/CAMERA.png, or FRAME.png for a single camera"
    )
    raise EntryError(message)


def _list_by_frame(folder: Path, inner: Mapping[str, list[Path]], camera: str) -> dict[int, Path]:
    """Return the pictures of a camera in the layout with one folder per frame."""
    found = {path.parent: path for paths in inner.values() for path in paths if path.stem == camera}
    return {frame: found[place] for frame, place in number_files(found, folder).items()}


def _find_pictures(folder: Path) -> list[Path]:
    return [path for path in folder.iterdir() if path.suffix.lower() in _SUFFIXES]
