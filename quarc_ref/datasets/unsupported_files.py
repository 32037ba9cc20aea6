"""Finds recordings that cannot be read, for errors about missing recordings.

They are pictures and videos in other formats, and broken links.
"""

from itertools import chain, islice
from pathlib import Path

_SUFFIXES = frozenset(
    {
        *(".360", ".asf", ".avi", ".braw", ".dv", ".flv", ".insv", ".m2t", ".m2ts", ".mpeg"),
        *(".mpg", ".mts", ".mxf", ".ogv", ".r3d", ".ts", ".vob", ".wmv", ".y4m"),
        *(".264", ".265", ".h264", ".h265", ".hevc", ".mjpeg", ".mjpg"),  # of Raspberry Pis
        *(".avif", ".bmp", ".exr", ".heic", ".heif", ".jp2", ".jxl", ".tif", ".tiff", ".webp"),
        *(".arw", ".cr2", ".cr3", ".dng", ".nef"),
    }
)
_PATTERNS = ("*", "*/*", "*/*/*")  # as deep as images/NAME/0000.png
_MAX_PATHS = 10_000  # of each pattern


def is_unsupported(path: Path) -> bool:
    """Return whether a file has the suffix of a picture or video that cannot be read."""
    return path.suffix.lower() in _SUFFIXES and not path.name.startswith(".")


def is_broken_link(path: Path) -> bool:
    """Return whether a path is a link to a file or folder that does not exist."""
    return path.is_symlink() and not path.exists()


def describe_unsupported_files(folder: Path) -> str:
    """Return advice about files in a folder that cannot be read, to append to an error message.

    The result is empty if there are no such files.
    """
    paths = chain.from_iterable(islice(folder.glob(pattern), _MAX_PATHS) for pattern in _PATTERNS)
    for path in paths:
        name = path.relative_to(folder)
        if is_broken_link(path) and not path.name.startswith("."):
            return f". {name} is a broken link: is the disk with its target connected?"
        if is_unsupported(path):
            return (
                f". Files such as {name} cannot be read: convert videos to mp4, and pictures to "
                "PNG or JPEG"
            )
    return ""
