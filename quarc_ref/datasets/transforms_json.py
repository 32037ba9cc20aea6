"""Captures in nerfstudio's `transforms.json`, of cameras that stand still.

Either every entry is a video, one to a camera, or entries are pictures with a
`time`; those of one pose and lens are then one camera's, in the order of their
times. A camera is named after what the paths of its pictures share.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from quarc_ref.datasets.calibration import CalibratedCamera
from quarc_ref.datasets.capture import Points
from quarc_ref.datasets.errors import (
    CountMismatchError,
    UnknownLayoutError,
    UnreadablePoseError,
)
from quarc_ref.datasets.footage import (
    USUAL_FRAMES_PER_SECOND,
    CaptureFiles,
    Footage,
    natural_order,
)
from quarc_ref.datasets.named_files import NamedFiles
from quarc_ref.datasets.pictures import FilePictures, VideoPictures
from quarc_ref.datasets.points_ply import read_points_ply
from quarc_ref.datasets.transforms_entries import Entry, Transforms, read_transforms
from quarc_ref.datasets.video import VideoReader

TRANSFORMS_NAME = "transforms.json"
_VIDEO_SUFFIXES = (".mp4", ".mov", ".mkv", ".webm")


@dataclass(frozen=True, slots=True, eq=False)
class _Rig:
    """The cameras of a file, in the order of their names.

    Attributes:
        cameras: As calibrated.
        entries: `[camera][frame]`; of a camera with a video, the video.
    """

    cameras: tuple[CalibratedCamera, ...]
    entries: tuple[tuple[Entry, ...], ...]


def read_nerfstudio(folder: Path) -> Footage:
    """Return what a folder of the layout holds.

    Args:
        folder: With `transforms.json` in it.

    Raises:
        CaptureError: A file is missing or malformed, or they do not fit together.
    """
    path = folder / TRANSFORMS_NAME
    transforms = read_transforms(path)
    entries = transforms.entries
    if all(PurePosixPath(entry.path).suffix.lower() in _VIDEO_SUFFIXES for entry in entries):
        return _join_videos(path, transforms, _build_rig(entries, path))
    if all(entry.time is not None for entry in entries):
        return _join_pictures(path, transforms, _build_rig(entries, path))
    message = (
        f"{path} is no multi-view video: every entry must be a video, or a picture with a 'time'"
    )
    raise UnknownLayoutError(message)


def _join_videos(path: Path, transforms: Transforms, rig: _Rig) -> Footage:
    """Return a capture of one video to a camera."""
    for camera, entries in zip(rig.cameras, rig.entries, strict=True):
        if len(entries) > 1:
            message = f"{path} has {len(entries)} videos like {camera.name}"
            raise CountMismatchError(message)
    named = NamedFiles(path)
    paths = tuple(named.find(entries[0].path) for entries in rig.entries)
    points, descriptions = _read_descriptions(path, transforms, named)
    videos = VideoPictures([VideoReader(path) for path in paths])
    return Footage(
        cameras=rig.cameras,
        frame_count=videos.frame_count,
        frames_per_second=transforms.frames_per_second or videos.frames_per_second,
        points=points,
        source=videos,
        files=CaptureFiles(descriptions, pictures=paths, sampled=paths),
        uneven=videos.uneven,
    )


def _join_pictures(path: Path, transforms: Transforms, rig: _Rig) -> Footage:
    """Return a capture of one file to a camera and frame."""
    named = NamedFiles(path)
    paths = [[named.find(entry.path) for entry in entries] for entries in rig.entries]
    points, descriptions = _read_descriptions(path, transforms, named)
    return Footage(
        cameras=rig.cameras,
        frame_count=_require_equal_times(rig),
        frames_per_second=transforms.frames_per_second or USUAL_FRAMES_PER_SECOND,
        points=points,
        source=FilePictures(paths, [camera.lens for camera in rig.cameras]),
        files=CaptureFiles(
            descriptions,
            pictures=tuple(path for row in paths for path in row),
            sampled=tuple(row[0] for row in paths),
        ),
    )


def _read_descriptions(
    path: Path, transforms: Transforms, named: NamedFiles
) -> tuple[Points | None, tuple[Path, ...]]:
    """Return the points that the file names, and the files that are not pictures."""
    if transforms.points is None:
        return None, (path,)
    points_path = named.find(transforms.points)
    return read_points_ply(points_path), (path, points_path)


def _require_equal_times(rig: _Rig) -> int:
    """Return how many pictures every camera has, each of a time of its own."""
    first = [entry.time for entry in rig.entries[0]]
    for camera, entries in zip(rig.cameras, rig.entries, strict=True):
        times = [entry.time for entry in entries]
        if times != first or len(set(times)) < len(times):
            message = (
                f"camera {camera.name} has {len(times)} pictures, not one of each of the "
                f"{len(first)} times of camera {rig.cameras[0].name}: every camera must stand "
                "still, and have a picture of every time"
            )
            raise CountMismatchError(message)
    return len(first)


def _build_rig(entries: Sequence[Entry], path: Path) -> _Rig:
    """Return the cameras of entries, each camera's entries in the order of their times."""
    groups: dict[object, list[Entry]] = {}
    for entry in sorted(entries, key=lambda entry: entry.time or 0.0):
        groups.setdefault((entry.lens, entry.matrix), []).append(entry)
    names = _name_cameras([[entry.path for entry in group] for group in groups.values()])
    named = dict(zip(names, groups.values(), strict=True))
    ordered = sorted(names, key=natural_order)
    return _Rig(
        cameras=tuple(_make_camera(name, named[name][0], path) for name in ordered),
        entries=tuple(tuple(named[name]) for name in ordered),
    )


def _make_camera(name: str, entry: Entry, path: Path) -> CalibratedCamera:
    try:
        return CalibratedCamera(name, entry.lens, entry.pose())
    except ValueError as error:
        message = f"{path}: camera {name}: {error}"
        raise UnreadablePoseError(message) from error


def _name_cameras(groups: Sequence[Sequence[str]]) -> list[str]:
    """Return a name for each group of paths.

    That is the stem they share (`0000/cam00.png`), or the folder they share
    (`cam00/0000.png`), or a number in the order of the groups.
    """
    parts: tuple[Callable[[PurePosixPath], str], ...] = (
        lambda path: path.stem,
        lambda path: path.parent.name,
    )
    for part in parts:
        shared = [{part(PurePosixPath(path)) for path in group} for group in groups]
        names = [name for candidates in shared for name in candidates]
        if len(names) == len(set(names)) == len(groups):
            return names
    return [f"cam{index:02d}" for index in range(len(groups))]
