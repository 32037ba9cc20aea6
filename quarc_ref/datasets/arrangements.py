"""Finds the pictures of a capture's cameras in common arrangements of files and folders.

The loader of a layout reads the camera names from the poses. `find_pictures` searches for the
cameras' videos or picture files in every arrangement, and returns the first complete set.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path

from quarc_ref.datasets.errors import CountMismatchError, MissingCameraError, MissingFileError
from quarc_ref.datasets.natural_order import natural_order
from quarc_ref.datasets.pictures import FilePictures, Pictures, VideoPictures
from quarc_ref.datasets.video import VideoReader

VIDEO_SUFFIXES = (".mp4", ".mov", ".m4v", ".qt", ".3gp", ".3g2", ".mkv", ".webm")
STILL_SUFFIXES = (".png", ".jpg", ".jpeg")

Files = Mapping[str, Sequence[Path]]  # camera name -> path of its video, or paths of its pictures


def is_video(path: Path) -> bool:
    """Return whether a file name has the suffix of a video and is not hidden."""
    return path.suffix.lower() in VIDEO_SUFFIXES and not path.name.startswith(".")


def is_still(path: Path) -> bool:
    """Return whether a file name has the suffix of a picture and is not hidden."""
    return path.suffix.lower() in STILL_SUFFIXES and not path.name.startswith(".")


def list_videos(folder: Path) -> Files:
    """Return the videos in a folder by camera; a video's name without suffix is the camera's."""
    return {path.stem: (path,) for path in _list(folder) if is_video(path) and path.is_file()}


def list_picture_folders(folder: Path, inside: str = "") -> Files:
    """Return the pictures in each camera's subfolder of a folder, in frame order.

    Args:
        folder: Folder that contains the cameras' folders.
        inside: Name of the folder of pictures in a camera's folder, such as `images`; empty if
            the pictures are directly in the camera's folder.
    """
    found = {each.name: _list_stills(each / inside) for each in _list(folder) if each.is_dir()}
    return {name: paths for name, paths in found.items() if paths}


def list_single_pictures(folder: Path) -> Files:
    """Return the pictures in a folder with one picture per camera, by name without suffix."""
    return {path.stem: (path,) for path in _list_stills(folder)}


def list_frame_folders(folder: Path) -> Files:
    """Return pictures by camera from one folder per frame, such as `0000/cam00.png`.

    Raises:
        CountMismatchError: The numbers of the frames have a gap.
        MissingCameraError: A frame lacks the picture of a camera that other frames have.
    """
    frames = sorted((p for p in _list(folder) if p.name.isdecimal()), key=lambda p: int(p.name))
    _require_regular_numbers(folder, [frame.name for frame in frames])
    found: dict[str, list[Path]] = {}
    for index, frame in enumerate(frames):
        for path in _list_stills(frame):
            row = found.setdefault(path.stem, [])
            if len(row) < index:
                _reject_missing(frames[len(row)], path.stem)
            row.append(path)
    return found


Lister = Callable[[Path], Files]
ARRANGEMENTS: tuple[tuple[str, Lister], ...] = (
    ("frames/0000/NAME.png", lambda folder: list_frame_folders(folder / "frames")),
    ("NAME.mp4", list_videos),
    ("videos/NAME.mp4", lambda folder: list_videos(folder / "videos")),
    ("NAME/0000.png", list_picture_folders),
    ("NAME/images/0000.png", lambda folder: list_picture_folders(folder, "images")),
    ("images/NAME/0000.png", lambda folder: list_picture_folders(folder / "images")),
    ("images/NAME.png", lambda folder: list_single_pictures(folder / "images")),
)


def find_pictures(folder: Path, names: Sequence[str]) -> Pictures:
    """Find the pictures of all cameras of a capture, in any known arrangement.

    Args:
        folder: Folder of the capture.
        names: Names of the cameras, at least one.

    Raises:
        MissingFileError: No camera has a picture or a video in any arrangement.
        MissingCameraError: Some cameras have no pictures.
        CaptureError: A file cannot be read, or the files are inconsistent.
    """
    best: tuple[str, Files] = ("", {})
    for pattern, list_files in ARRANGEMENTS:
        found = list_files(folder)
        if all(name in found for name in names):
            return open_pictures([found[name] for name in names])
        if sum(name in found for name in names) > sum(name in best[1] for name in names):
            best = pattern, found
    missing = [name for name in names if name not in best[1]]
    if len(missing) == len(names):
        patterns = ", ".join(pattern for pattern, _ in ARRANGEMENTS)
        message = (
            f"{folder} has poses for cameras {_shorten(names)}, but no pictures of them; "
            f"looked for {patterns} (or another suffix of a video or picture)"
        )
        raise MissingFileError(message)
    message = (
        f"camera {_shorten(missing)} has a pose, but {folder} has no {best[0]} for it: add "
        "the files, or remove the cameras from the poses"
    )
    raise MissingCameraError(message)


def open_pictures(paths: Sequence[Sequence[Path]], *, numbered: bool = True) -> Pictures:
    """Open picture or video files as a source of pictures.

    Args:
        paths: `[camera]` video files, or `[camera][frame]` picture files.
        numbered: Whether to reject a camera whose picture numbers have a gap.

    Raises:
        CaptureError: A file cannot be read, or the files are inconsistent.
    """
    if all(len(row) == 1 and is_video(row[0]) for row in paths):
        return VideoPictures([VideoReader(row[0]) for row in paths])
    for row in paths if numbered else ():
        _require_regular_numbers(row[0].parent, [path.stem for path in row])
    return FilePictures(paths)


def _shorten(names: Sequence[str]) -> str:
    return ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")


def _reject_missing(frame: Path, name: str) -> None:
    message = f"frame {frame} has no picture of camera {name}, such as {name}.png"
    raise MissingCameraError(message)


def _list(folder: Path) -> list[Path]:
    """Return the contents of a folder, in natural order; empty if it is not a folder."""
    if not folder.is_dir():
        return []
    return sorted(folder.iterdir(), key=lambda path: natural_order(path.name))


def _list_stills(folder: Path) -> list[Path]:
    return [path for path in _list(folder) if is_still(path) and path.is_file()]


def _require_regular_numbers(folder: Path, names: Sequence[str]) -> None:
    """Check that the last number in each file name increases by a constant step, such as 1.

    Raises:
        CountMismatchError: The steps differ, which means that pictures are missing.
    """
    matches = [re.search(r"([0-9]{1,18})[^0-9]*$", name) for name in names]
    numbers = [int(match[1]) for match in matches if match]
    if len(numbers) < len(names) or len(names) < 2:
        return
    steps = [second - first for first, second in pairwise(numbers)]
    for index, step in enumerate(steps):
        if step != min(steps):
            message = (
                f"{folder} has no frames between {names[index]} and {names[index + 1]}: add the "
                "missing files"
            )
            raise CountMismatchError(message)
