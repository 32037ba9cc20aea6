"""Finds videos that are too deep in a folder, for errors about missing recordings."""

from itertools import islice
from pathlib import Path

from quarc_ref.datasets.arrangements import is_video
from quarc_ref.datasets.natural_order import natural_order

_PATTERNS = ("*/*", "*/*/*", "*/*/*/*")  # as deep as cam00/DCIM/100GOPRO/GX010001.MP4
_MAX_PATHS = 10_000  # of each pattern
_MIN_CAMERAS = 3
_JOIN_PARTS = (  # Cameras with FAT or exFAT cards begin a new file every 4 GB.
    ". If the videos in a folder are parts of one recording, join them first (ffmpeg -f concat)"
)


def describe_nested_videos(folder: Path) -> str:
    """Return advice about videos deeper in a folder, to append to an error message.

    All can be in one folder, or those of each camera in a folder of its own. The result is empty if
    there are no such videos.
    """
    paths = [path for pattern in _PATTERNS for path in islice(folder.glob(pattern), _MAX_PATHS)]
    names = [path.relative_to(folder) for path in paths if is_video(path)]
    names = [name for name in names if not any(part.startswith(".") for part in name.parts)]
    folder_names = {name.parent for name in names}
    if len(folder_names) == 1 and len(names) >= _MIN_CAMERAS:
        return f". There are {len(names)} videos in {folder / folder_names.pop()}: use that folder"
    if len(folder_names) < 2:
        return ""
    first = min(names, key=lambda name: natural_order(str(name)))
    has_parts = len(names) > len(folder_names)
    return (
        f". {first} is in a folder of its own: put the videos of all cameras into one folder, with "
        f"names such as {first.parts[0]}{first.suffix}{_JOIN_PARTS if has_parts else ''}"
    )
