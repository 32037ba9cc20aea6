"""Finds the pictures of a capture's cameras in common arrangements of files and folders.

The loader of a layout reads the camera names from the poses. `find_pictures` searches for the
cameras' videos or picture files in every arrangement, and returns the first complete set.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from quarc_ref.datasets.errors import (
    CaptureError,
    CountMismatchError,
    MissingCameraError,
    MissingFileError,
)
from quarc_ref.datasets.findings import Finding, format_names, report_missing_poses
from quarc_ref.datasets.frame_numbers import find_gap
from quarc_ref.datasets.natural_order import natural_order
from quarc_ref.datasets.pictures import FilePictures, Pictures, VideoPictures
from quarc_ref.datasets.unsupported_files import describe_unsupported_files
from quarc_ref.datasets.video import VideoReader

VIDEO_SUFFIXES = (".mp4", ".mov", ".m4v", ".qt", ".3gp", ".3g2", ".mkv", ".webm")
MASK_FOLDER_NAME = "masks"
STILL_SUFFIXES = (".png", ".jpg", ".jpeg")

Files = Mapping[str, Sequence[Path]]  # camera name -> path of its video, or paths of its pictures


def is_video(path: Path) -> bool:
    """Return whether a file has the suffix of a video and is not hidden."""
    return path.suffix.lower() in VIDEO_SUFFIXES and not path.name.startswith(".")


def is_still(path: Path) -> bool:
    """Return whether a file has the suffix of a picture and is not hidden."""
    return path.suffix.lower() in STILL_SUFFIXES and not path.name.startswith(".")


def list_videos(folder: Path) -> Files:
    """Return the videos in a folder by camera name, which is the file name without suffix.

    Raises:
        CountMismatchError: Two videos differ only in their suffixes.
    """
    return _map_by_name(
        [path for path in _list_contents(folder) if is_video(path) and path.is_file()]
    )


def list_picture_folders(folder: Path, subfolder: str = "") -> Files:
    """Return the pictures in each camera's subfolder of a folder, in frame order.

    Args:
        folder: Folder that contains the cameras' folders.
        subfolder: Name of the folder inside each camera's folder that contains the pictures, such
            as `images`; empty if the pictures are directly in the camera's folder.
    """
    pictures = {
        camera_folder.name: _list_stills(camera_folder / subfolder)
        for camera_folder in _list_contents(folder)
        if camera_folder.is_dir()
    }
    return {name: paths for name, paths in pictures.items() if paths}


def list_single_pictures(folder: Path) -> Files:
    """Return the pictures in a folder by camera name, which is the file name without suffix.

    Raises:
        CountMismatchError: Two pictures differ only in their suffixes.
    """
    return _map_by_name(_list_stills(folder))


def list_frame_folders(folder: Path) -> Files:
    """Return the pictures by camera name from a folder with one subfolder per frame.

    For example, a picture has the path `0000/cam00.png`.

    Raises:
        CountMismatchError: The numbers of the subfolders have a gap.
        MissingCameraError: A frame lacks the picture of a camera that other frames have.
    """
    frame_folders = sorted(
        (path for path in _list_contents(folder) if path.name.isdecimal()),
        key=lambda path: int(path.name),
    )
    _require_regular_numbers(folder, [frame_folder.name for frame_folder in frame_folders])
    pictures: dict[str, list[Path]] = {}
    for index, frame_folder in enumerate(frame_folders):
        for path in _list_stills(frame_folder):
            camera_pictures = pictures.setdefault(path.stem, [])
            if len(camera_pictures) < index:
                _raise_missing_picture(frame_folders[len(camera_pictures)], path.stem)
            camera_pictures.append(path)
    return pictures


def _omit_masks(files: Files) -> Files:
    """Return the files without those of the folder of masks, which is no camera."""
    return {name: paths for name, paths in files.items() if name != MASK_FOLDER_NAME}


FileLister = Callable[[Path], Files]
ARRANGEMENTS: tuple[tuple[str, FileLister], ...] = (
    ("frames/0000/NAME.png", lambda folder: list_frame_folders(folder / "frames")),
    ("NAME.mp4", list_videos),
    ("videos/NAME.mp4", lambda folder: list_videos(folder / "videos")),
    ("NAME/0000.png", lambda folder: _omit_masks(list_picture_folders(folder))),
    ("NAME/images/0000.png", lambda folder: list_picture_folders(folder, "images")),
    ("images/NAME/0000.png", lambda folder: list_picture_folders(folder / "images")),
    ("images/NAME.png", lambda folder: list_single_pictures(folder / "images")),
)


def list_arrangements(folder: Path) -> Iterator[tuple[str, Files]]:
    """Yield the pattern and the files of every arrangement, in order of preference.

    Inconsistent files, such as a folder `frames` in which pictures are missing, do not matter if
    another arrangement has everything. They are an error at the end of the iteration.

    Raises:
        CaptureError: All arrangements were used, and the files of one are inconsistent.
    """
    first_error = None
    for pattern, list_files in ARRANGEMENTS:
        try:
            files = list_files(folder)
        except CaptureError as error:
            first_error = first_error or error
        else:
            yield pattern, files
    if first_error is not None:
        raise first_error


def find_pictures(folder: Path, names: Sequence[str]) -> Pictures:
    """Find the pictures of all cameras of a capture in any known arrangement of files.

    Args:
        folder: Folder of the capture.
        names: Names of the cameras, at least one.

    Raises:
        MissingFileError: No camera has a picture or a video in any arrangement.
        MissingCameraError: Some cameras have no pictures.
        CaptureError: A file cannot be read, or the files are inconsistent.
    """
    best_match: tuple[str, Files] = ("", {})  # or the most files, if no name matches
    for pattern, files in list_arrangements(folder):
        if all(name in files for name in names):
            return open_pictures([files[name] for name in names])
        best_match = max(
            best_match,
            (pattern, files),
            key=lambda match: (sum(name in match[1] for name in names), len(match[1])),
        )
    missing_names = [name for name in names if name not in best_match[1]]
    if len(missing_names) == len(names):
        patterns = ", ".join(pattern for pattern, _ in ARRANGEMENTS)
        message = (
            f"{folder} has poses for cameras {format_names(names)}, but no pictures of these "
            f"cameras; looked for {patterns} (or other suffixes of videos and pictures)"
            f"{_describe_found(*best_match)}{describe_unsupported_files(folder)}"
        )
        raise MissingFileError(message)
    message = (
        f"{folder} has poses of {format_names(missing_names)}, but no pictures, such as "
        f"{best_match[0].replace('NAME', missing_names[0])}: add the missing files, or remove the "
        f"extra poses{describe_unsupported_files(folder)}"
    )
    raise MissingCameraError(message)


def find_cameras_without_poses(
    folder: Path, names: Sequence[str], poses: Path
) -> tuple[Finding, ...]:
    """Return a finding if there are pictures next to those of the cameras, but no poses.

    Folders in the capture's folder are not reported, because they need not belong to a camera.

    Args:
        folder: Folder of the capture.
        names: Names of the cameras.
        poses: File or folder of the poses.
    """
    with suppress(CaptureError):  # files of another arrangement are inconsistent
        for pattern, files in list_arrangements(folder):
            if all(name in files for name in names):
                unused_names = [name for name in files if name not in names]
                if not pattern.startswith("NAME/"):
                    return report_missing_poses(unused_names, poses)
                return ()
    return ()


def open_pictures(paths: Sequence[Sequence[Path]], *, reject_gaps: bool = True) -> Pictures:
    """Open picture or video files as a source of pictures.

    Args:
        paths: `[camera]` video files, or `[camera][frame]` picture files.
        reject_gaps: Whether to raise an error if the numbers in the picture names have a gap, or
            if two pictures have the same name and different suffixes.

    Raises:
        CaptureError: A file cannot be read, or the files are inconsistent.
    """
    if all(len(camera_paths) == 1 and is_video(camera_paths[0]) for camera_paths in paths):
        return VideoPictures([VideoReader(camera_paths[0]) for camera_paths in paths])
    for camera_paths in paths if reject_gaps else ():
        _require_distinct_names(camera_paths)
        _require_regular_numbers(camera_paths[0].parent, [path.stem for path in camera_paths])
    return FilePictures(paths)


def _describe_found(pattern: str, files: Files) -> str:
    """Return which recordings were found, to append to an error message; empty if none were."""
    names = format_names(list(files))
    return (
        f". There are recordings of {names} ({pattern}): rename them or the poses" if files else ""
    )


def _raise_missing_picture(frame_folder: Path, name: str) -> None:
    message = f"{frame_folder} has no picture of camera {name}, such as {name}.png"
    raise MissingCameraError(message)


def _list_contents(folder: Path) -> list[Path]:
    """Return what is in a folder and not hidden, in natural order; nothing if it is no folder."""
    if not folder.is_dir():
        return []
    visible_paths = (path for path in folder.iterdir() if not path.name.startswith("."))
    return sorted(visible_paths, key=lambda path: natural_order(path.name))


def _list_stills(folder: Path) -> list[Path]:
    return [path for path in _list_contents(folder) if is_still(path) and path.is_file()]


def _map_by_name(paths: Sequence[Path]) -> Files:
    """Return the only file of each camera by the camera's name."""
    path_by_name: dict[str, Path] = {}
    for path in paths:
        other_path = path_by_name.setdefault(path.stem, path)
        if other_path is not path:
            message = (
                f"{path.parent} has two files of camera {path.stem}, {other_path.name} and "
                f"{path.name}: remove one of them"
            )
            raise CountMismatchError(message)
    return {name: (path,) for name, path in path_by_name.items()}


def _require_distinct_names(paths: Sequence[Path]) -> None:
    """Check that no two pictures of a camera differ only in their suffixes.

    Raises:
        CountMismatchError: There are two pictures of the same frame.
    """
    path_by_name: dict[Path, Path] = {}
    for path in paths:
        other_path = path_by_name.setdefault(path.with_suffix(""), path)
        if other_path is not path:
            message = (
                f"{path.parent} has two pictures of the same frame, {other_path.name} and "
                f"{path.name}: remove one of them"
            )
            raise CountMismatchError(message)


def _require_regular_numbers(folder: Path, names: Sequence[str]) -> None:
    """Check that the last numbers in the file names increase in equal steps.

    Raises:
        CountMismatchError: The steps differ, so pictures are missing.
    """
    gap = find_gap(names)
    if gap is not None:
        message = f"{folder} has no frames between {gap[0]} and {gap[1]}: add the missing files"
        raise CountMismatchError(message)
