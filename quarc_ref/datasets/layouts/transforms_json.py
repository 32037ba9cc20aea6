"""Loads captures of static cameras that are described by nerfstudio's `transforms.json`.

nerfstudio's documentation describes the format (docs.nerf.studio, "Data conventions"). Either every
entry is the video of a camera, or every entry is a picture. Pictures with the same pose and lens
belong to one camera, and are ordered by `time`, or by name if no entry has a time. Without times, a
gap in the numbers of a camera's names is an error, unless all cameras have the same numbers. A
camera is named after the common part of its pictures' paths.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

from quarc_ref.datasets.agreement import compare_stated_rate
from quarc_ref.datasets.arrangements import (
    VIDEO_SUFFIXES,
    find_cameras_without_poses,
    open_pictures,
)
from quarc_ref.datasets.calibration import CalibratedCamera
from quarc_ref.datasets.capture import Points
from quarc_ref.datasets.errors import (
    CountMismatchError,
    MaskCountError,
    UnknownLayoutError,
    UnreadablePoseError,
)
from quarc_ref.datasets.footage import Footage
from quarc_ref.datasets.frame_numbers import compare_first_numbers, find_gap, list_last_numbers
from quarc_ref.datasets.layouts.transforms_entries import Entry, Transforms, read_transforms
from quarc_ref.datasets.masks import FileMasks
from quarc_ref.datasets.named_files import NamedFileResolver
from quarc_ref.datasets.natural_order import natural_order
from quarc_ref.datasets.pictures import Pictures
from quarc_ref.datasets.points_ply import read_points_ply

TRANSFORMS_NAME = "transforms.json"


@dataclass(frozen=True, slots=True, eq=False)
class _Rig:
    """The cameras of a `transforms.json`, and the entries of each camera.

    Attributes:
        cameras: Calibrated cameras in the order of their names.
        entries: `[camera][frame]` entries; a camera with a video has only one entry.
    """

    cameras: tuple[CalibratedCamera, ...]
    entries: tuple[tuple[Entry, ...], ...]


def read_nerfstudio(folder: Path) -> Footage:
    """Load a capture in nerfstudio's format.

    Args:
        folder: Folder with `transforms.json`.

    Raises:
        CaptureError: A file is missing or malformed, or the files are inconsistent.
    """
    path = folder / TRANSFORMS_NAME
    transforms = read_transforms(path)
    entries = transforms.entries
    if all(PurePosixPath(entry.path).suffix.lower() in VIDEO_SUFFIXES for entry in entries):
        return _load_videos(path, transforms, _build_rig(entries, path))
    if all(entry.time is None for entry in entries):
        rig = _build_rig(_set_times_by_name(entries), path)
        _require_no_gaps(rig, path)
        _require_equal_times(rig, may_end_early=False)
        footage = _make_footage(path, transforms, rig)
        names = [camera.name for camera in rig.cameras]
        return replace(footage, findings=compare_first_numbers(names, footage.source))
    if all(entry.time is not None for entry in entries):
        rig = _build_rig(entries, path)
        _require_equal_times(rig, may_end_early=True)
        return _make_footage(path, transforms, rig)
    message = (
        f"{path} is not a multi-view video: its entries must be either all videos or all pictures, "
        "and if one picture has a 'time', all pictures must have one"
    )
    raise UnknownLayoutError(message)


def _load_videos(path: Path, transforms: Transforms, rig: _Rig) -> Footage:
    """Load a capture with one video per camera."""
    for camera, entries in zip(rig.cameras, rig.entries, strict=True):
        if len(entries) > 1:
            message = (
                f"{path} names {len(entries)} videos for camera {camera.name}; a camera can have "
                "only one video"
            )
            raise CountMismatchError(message)
    footage = _make_footage(path, transforms, rig)
    names = [camera.name for camera in rig.cameras]
    finding = compare_stated_rate(footage.stated_frame_rate, footage.source.frames_per_second)
    findings = (*find_cameras_without_poses(path.parent, names, path), finding)
    return replace(footage, findings=tuple(filter(None, findings)))


def _make_footage(path: Path, transforms: Transforms, rig: _Rig) -> Footage:
    resolver = NamedFileResolver(path)
    paths = [[resolver.find(entry.path) for entry in entries] for entries in rig.entries]
    _require_own_files(path, rig, paths)
    points, description_files = _read_points(path, transforms, resolver)
    source, frame_rate = open_pictures(paths, reject_gaps=False), transforms.frames_per_second
    masks = _open_masks(resolver, rig, source)
    return Footage(rig.cameras, source, points, description_files, frame_rate, masks=masks)


def _require_own_files(path: Path, rig: _Rig, paths: Sequence[Sequence[Path]]) -> None:
    """Check that no two cameras have the same picture or video.

    Raises:
        CountMismatchError: Two entries with different poses or lenses name the same file.
    """
    owners: dict[Path, str] = {}
    for camera, camera_paths in zip(rig.cameras, paths, strict=True):
        for file in camera_paths:
            if owners.setdefault(file, camera.name) != camera.name:
                message = f"{path} names {file.name} in entries with different poses or lenses"
                raise CountMismatchError(message)


def _open_masks(resolver: NamedFileResolver, rig: _Rig, source: Pictures) -> FileMasks | None:
    """Return the masks that the entries name; None if no entry names a mask.

    Raises:
        MaskCountError: Only some entries of a camera name a mask.
    """
    mask_paths = [
        [resolver.find(entry.mask_path) for entry in entries if entry.mask_path]
        for entries in rig.entries
    ]
    for camera, entries, paths in zip(rig.cameras, rig.entries, mask_paths, strict=True):
        if len(paths) not in (0, len(entries)):
            message = (
                f"{len(paths)} of the {len(entries)} entries of camera {camera.name} have a "
                "'mask_path': give every entry of a camera a mask, or none"
            )
            raise MaskCountError(message)
    return FileMasks(mask_paths, source.sizes, source.lengths) if any(mask_paths) else None


def _read_points(
    path: Path, transforms: Transforms, resolver: NamedFileResolver
) -> tuple[Points | None, tuple[Path, ...]]:
    """Return the initial points, and the paths of `transforms.json` and of the points file."""
    if transforms.points_path is None:
        return None, (path,)
    points_path = resolver.find(transforms.points_path)
    return read_points_ply(points_path), (path, points_path)


def _require_equal_times(rig: _Rig, *, may_end_early: bool) -> None:
    """Check that every camera has exactly one picture for each time.

    Args:
        rig: The rig.
        may_end_early: Whether a camera may lack the last times. If the file has no times, a camera
            that moves would be accepted as several cameras that end after their first pictures.

    Raises:
        CountMismatchError: A camera lacks a picture, or has two for one time.
    """
    times_by_camera = [[entry.time for entry in entries] for entries in rig.entries]
    longest = max(range(len(times_by_camera)), key=lambda index: len(times_by_camera[index]))
    all_times = times_by_camera[longest]
    for camera, times in zip(rig.cameras, times_by_camera, strict=True):
        expected_times = all_times[: len(times)] if may_end_early else all_times
        if times != expected_times or len(set(times)) < len(times):
            message = (
                f"the times of the {len(times)} pictures of camera {camera.name} are not the "
                f"{len(all_times)} times of camera {rig.cameras[longest].name}: every camera must "
                "be static, and must have one picture per time"
            )
            raise CountMismatchError(message)


def _set_times_by_name(entries: Sequence[Entry]) -> tuple[Entry, ...]:
    """Order the entries of each camera by name, and set their times to 0, 1, 2 and so on."""
    last_indices: dict[object, int] = {}
    timed_entries = []
    for entry in sorted(entries, key=lambda entry: natural_order(entry.path)):
        camera_key = (entry.lens, entry.camera_to_world)
        last_indices[camera_key] = last_indices.get(camera_key, -1) + 1
        timed_entries.append(replace(entry, time=float(last_indices[camera_key])))
    return tuple(timed_entries)


def _require_no_gaps(rig: _Rig, path: Path) -> None:
    """Check that pictures without a time are of the same frames in all cameras.

    Raises:
        CountMismatchError: The numbers in the names of a camera's pictures have a gap, and the
            other cameras do not have the same numbers.
    """
    names = [_list_frame_names([entry.path for entry in entries]) for entries in rig.entries]
    numbers = [list_last_numbers(camera_names) for camera_names in names]
    if all(camera_numbers == numbers[0] for camera_numbers in numbers):
        return
    for camera, camera_names in zip(rig.cameras, names, strict=True):
        gap = find_gap(camera_names)
        if gap is not None:
            message = (
                f"{path} has no pictures of camera {camera.name} between {gap[0]} and {gap[1]}: "
                "add the missing pictures, or give every entry a 'time'"
            )
            raise CountMismatchError(message)


def _list_frame_names(paths: Sequence[str]) -> list[str]:
    """Return the parts of a camera's paths that name the frame: file names, or else folders."""
    stems = [PurePosixPath(path).stem for path in paths]
    return stems if len(set(stems)) > 1 else [PurePosixPath(path).parent.name for path in paths]


def _build_rig(entries: Sequence[Entry], path: Path) -> _Rig:
    """Group entries by camera, and order each camera's entries by time."""
    groups: dict[object, list[Entry]] = {}
    for entry in sorted(entries, key=lambda entry: entry.time or 0.0):
        groups.setdefault((entry.lens, entry.camera_to_world), []).append(entry)
    names = _name_cameras([[entry.path for entry in group] for group in groups.values()])
    entries_by_name = dict(zip(names, groups.values(), strict=True))
    sorted_names = sorted(names, key=natural_order)
    return _Rig(
        cameras=tuple(_make_camera(name, entries_by_name[name][0], path) for name in sorted_names),
        entries=tuple(tuple(entries_by_name[name]) for name in sorted_names),
    )


def _make_camera(name: str, entry: Entry, path: Path) -> CalibratedCamera:
    try:
        return CalibratedCamera(name, entry.lens, entry.pose())
    except ValueError as error:
        message = f"{path}: camera {name}: {error}"
        raise UnreadablePoseError(message) from error


def _name_cameras(groups: Sequence[Sequence[str]]) -> list[str]:
    """Return a name for each group of paths.

    A group is named after the common file name of its paths (`0000/cam00.png`), their common folder
    (`cam00/0000.png`, `cam00/images/0000.png`), or the common part of their file names before the
    number of the frame (`cam00_0000.png`). If no rule gives a distinct name to every group, the
    groups are numbered.
    """
    name_functions: tuple[Callable[[PurePosixPath], str], ...] = (
        lambda path: path.stem,
        lambda path: path.parent.name,
        lambda path: path.parent.parent.name,
        lambda path: path.stem.rstrip("0123456789").rstrip("-_. "),
    )
    for get_name in name_functions:
        names_by_group = [{get_name(PurePosixPath(path)) for path in group} for group in groups]
        names = [name for common_names in names_by_group for name in common_names]
        if all(names) and len(names) == len(set(names)) == len(groups):
            return names
    return [f"cam{index:02d}" for index in range(len(groups))]
