"""Finds recordings that cannot be used, next to those of the other cameras of a rig."""

from collections.abc import Collection
from pathlib import Path

from quarc_ref.datasets.arrangements import MASK_FOLDER_NAME, is_still, is_video
from quarc_ref.datasets.unsupported_files import is_broken_link, is_unsupported

_FRAME_PATTERN = "frames/"  # there, a camera without a picture is an error


def find_left_out_recordings(
    folder: Path, pattern: str, used_names: Collection[str]
) -> dict[str, str]:
    """Return why recordings cannot be used, by the name of the camera.

    Args:
        folder: Folder of the recordings.
        pattern: Pattern of the used files, as in `ARRANGEMENTS`.
        used_names: Names of the cameras whose recordings are used; other files with these names,
            such as originals that were converted, are not reported.
    """
    if pattern.startswith(_FRAME_PATTERN):
        return {}
    parent, _, rest = pattern.partition("NAME")
    reasons = {}
    for path in sorted((folder / parent).iterdir()):
        name = path.name if path.is_dir() else path.stem
        if path.name.startswith(".") or name in used_names:
            continue
        reason = _explain(path, in_folders="/" in rest)
        if reason:
            reasons[name] = f"{path.name} {reason}"
    return reasons


def _explain(path: Path, *, in_folders: bool) -> str | None:
    """Return why a file or folder is not used; None if it does not look like a recording.

    Args:
        path: The file or folder.
        in_folders: Whether the used recordings are folders of pictures.
    """
    if is_broken_link(path):
        has_suffix = is_video(path) or is_still(path) or is_unsupported(path)
        return "is a broken link" if has_suffix or not path.suffix else None
    if path.is_dir():
        is_camera = in_folders and path.name != MASK_FOLDER_NAME
        return "has no PNG or JPEG pictures" if is_camera else None
    if is_unsupported(path):
        return "cannot be read: convert videos to mp4, and pictures to PNG or JPEG"
    return "is a video, but the other recordings are pictures" if is_video(path) else None
