"""Opens folders of pictures from other renderers as entries of a comparison.

The folder contains PNG or JPEG files named `CAMERA/FRAME.png` or `FRAME/CAMERA.png`, or `FRAME.png`
if there is only one camera. The last number in the name `FRAME` is the ordinal of the frame.
Transparent pictures are put on black, as all other renderings.
"""

from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np

from quarc_ref.datasets.arrangements import is_still
from quarc_ref.datasets.stills import read_still, read_still_alpha
from quarc_ref.evaluation.comparison.entries import (
    RENDERS_KIND,
    Entry,
    EntryError,
    EntryInfo,
    Label,
)
from quarc_ref.evaluation.comparison.numbered_files import sort_by_frame_number
from quarc_ref.evaluation.metrics import Picture
from quarc_ref.format.cameras import Camera


def open_renders(folder: Path, label: Label, cameras: Collection[str]) -> Entry:
    """Open a folder of pictures, whose size says nothing about the method that rendered them.

    Args:
        folder: Folder of the pictures.
        label: Method and operating point.
        cameras: Names of the cameras to compare on.

    Raises:
        EntryError: The layout of the folder is unknown, a camera is missing, or two pictures
            are of the same camera and frame.
        OSError: The folder cannot be read.
    """
    paths_by_camera = _list_pictures(folder, cameras)
    common_frames = set.intersection(*(set(frames) for frames in paths_by_camera.values()))
    info = EntryInfo(RENDERS_KIND, tuple(sorted(common_frames)), byte_count=None)
    return _RenderEntry(label, info, paths_by_camera)


class _RenderEntry(Entry):
    """An entry whose frames are picture files."""

    def __init__(
        self, label: Label, info: EntryInfo, paths_by_camera: Mapping[str, Mapping[int, Path]]
    ) -> None:
        super().__init__(label, info)
        self._paths_by_camera = paths_by_camera

    def render(self, frame: int, cameras: Mapping[str, Camera]) -> dict[str, Picture]:
        """See `Entry.render`."""
        return {
            name: _read_picture(self._paths_by_camera[name][frame], camera)
            for name, camera in cameras.items()
        }


def _read_picture(path: Path, camera: Camera) -> Picture:
    """Read a picture of a camera; raise EntryError if it does not have the camera's size."""
    levels = read_still(path)
    height, width, _ = levels.shape
    if (width, height) != (camera.width, camera.height):
        message = (
            f"{path} has {width} x {height} pixels, but pictures of {camera.name} are compared at "
            f"{camera.width} x {camera.height}: render it at this size"
        )
        raise EntryError(message)
    picture: Picture = levels.astype(np.float32) / np.float32(255)
    alpha = read_still_alpha(path)
    if alpha is not None:
        picture *= alpha[..., None] / np.float32(255)
    return picture


def _list_pictures(folder: Path, cameras: Collection[str]) -> dict[str, dict[int, Path]]:
    """Return the picture files by camera, then by frame."""
    folder_pictures = _find_pictures(folder)
    if folder_pictures and len(cameras) == 1:
        return {name: sort_by_frame_number(folder_pictures, folder) for name in cameras}
    subfolder_pictures = {
        subfolder.name: _find_pictures(subfolder)
        for subfolder in folder.iterdir()
        if subfolder.is_dir()
    }
    if not folder_pictures and set(cameras) <= set(subfolder_pictures):
        return {
            name: sort_by_frame_number(subfolder_pictures[name], folder / name) for name in cameras
        }
    stems = {path.stem for pictures in subfolder_pictures.values() for path in pictures}
    if not folder_pictures and set(cameras) <= stems:
        return {name: _list_by_frame(folder, subfolder_pictures, name) for name in cameras}
    found_names = set(cameras) & (set(subfolder_pictures) | stems)
    camera_names = ", ".join(sorted(set(cameras) - found_names) or sorted(cameras))
    if found_names and not folder_pictures:
        found_text = ", ".join(sorted(found_names))
        message = f"{folder} has pictures of {found_text}, but none of {camera_names}"
        raise EntryError(message)
    message = (
        f"{folder} has neither .ply files nor pictures of {camera_names}: put one .ply file per "
        "frame into the folder, or name the pictures CAMERA/FRAME.png or FRAME/CAMERA.png, or "
        "FRAME.png for a single camera"
    )
    raise EntryError(message)


def _list_by_frame(
    folder: Path, subfolder_pictures: Mapping[str, list[Path]], camera: str
) -> dict[int, Path]:
    """Return a camera's picture files by frame, for folders with the layout `FRAME/CAMERA.png`.

    Raises:
        EntryError: A folder has two pictures of the camera, or two folders the same frame number.
    """
    picture_by_folder: dict[Path, Path] = {}
    for path in (path for paths in subfolder_pictures.values() for path in paths):
        if path.stem != camera:
            continue
        if path.parent in picture_by_folder:
            other_name = picture_by_folder[path.parent].name
            message = f"{path.parent} has two pictures of {camera}: {other_name} and {path.name}"
            raise EntryError(message)
        picture_by_folder[path.parent] = path
    return {
        frame: picture_by_folder[subfolder]
        for frame, subfolder in sort_by_frame_number(picture_by_folder, folder).items()
    }


def _find_pictures(folder: Path) -> list[Path]:
    return [path for path in folder.iterdir() if is_still(path)]
