"""Lists the known layouts of captures, and chooses the layout of a folder by its files.

To add a layout, write a module with a `read_...` function, and add an entry to `LAYOUTS`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from quarc_ref.datasets.arrangements import (
    list_picture_folders,
    list_videos,
)
from quarc_ref.datasets.errors import UnknownLayoutError
from quarc_ref.datasets.footage import Footage
from quarc_ref.datasets.layouts.colmap import read_colmap
from quarc_ref.datasets.layouts.easymocap import read_easymocap
from quarc_ref.datasets.layouts.n3dv import read_n3dv
from quarc_ref.datasets.layouts.panoptic import read_panoptic
from quarc_ref.datasets.layouts.transforms_json import read_nerfstudio
from quarc_ref.datasets.nested_videos import describe_nested_videos
from quarc_ref.datasets.unsupported_files import describe_unsupported_files
from quarc_ref.wording import format_count


@dataclass(frozen=True, slots=True)
class Layout:
    """A known layout of captures.

    Attributes:
        name: Common name of the layout.
        required_files: Files that the layout requires. Each entry has a file name for messages,
            followed by patterns for `Path.glob`, at least one of which must match a file.
        read: Function that loads the capture in a folder.
    """

    name: str
    required_files: tuple[tuple[str, ...], ...]
    read: Callable[[Path], Footage]

    def find_missing_files(self, folder: Path) -> list[str]:
        """Return the names of the required files that are missing from a folder."""
        return [
            name
            for name, *patterns in self.required_files
            if not any(path.is_file() for pattern in patterns for path in folder.glob(pattern))
        ]


_MODEL_FOLDERS = ("sparse*/0/", "sparse*/", "")


def _list_model_requirements(name: str) -> tuple[str, ...]:
    patterns = [
        f"{folder}{name}.{suffix}" for folder in _MODEL_FOLDERS for suffix in ("bin", "txt")
    ]
    return (f"sparse/0/{name}.bin or .txt", *patterns)


LAYOUTS = (
    Layout(
        "N3DV, DyNeRF, MeetRoom with poses", (("poses_bounds.npy", "poses_bounds.npy"),), read_n3dv
    ),
    Layout("nerfstudio", (("transforms.json", "transforms.json"),), read_nerfstudio),
    Layout(
        "COLMAP",
        (_list_model_requirements("cameras"), _list_model_requirements("images")),
        read_colmap,
    ),
    Layout(
        "EasyMocap, ENeRF",
        (("intri.yml", "intri.yml"), ("extri.yml", "extri.yml")),
        read_easymocap,
    ),
    Layout("CMU Panoptic", (("calibration_*.json", "calibration_*.json"),), read_panoptic),
)


def choose_layout(folder: Path) -> Layout:
    """Return the first entry of `LAYOUTS` whose required files are in a folder.

    Raises:
        UnknownLayoutError: No layout matches. The message lists the missing files of every layout,
            and suggests a remedy.
    """
    for layout in LAYOUTS:
        if not layout.find_missing_files(folder):
            return layout
    missing_files = [
        f"{layout.name} ({', '.join(layout.find_missing_files(folder))})" for layout in LAYOUTS
    ]
    message = (
        f"{folder} is not a capture in a known layout. The known layouts, with the files that are "
        "missing: "
    )
    raise UnknownLayoutError(message + "; ".join(missing_files) + _suggest_remedy(folder))


def describe_capture(folder: Path) -> str | None:
    """Return what a folder contains, such as "a folder of 3 videos"; None if unrecognized."""
    if not folder.is_dir():
        return None
    for layout in LAYOUTS:
        if not layout.find_missing_files(folder):
            return f"a capture ({layout.name})"
    video_count = sum(len(paths) for paths in list_videos(folder).values())
    other_count = sum(not path.name.startswith(".") for path in folder.iterdir()) - video_count
    if other_count or not video_count:
        return None
    return f"a folder of {format_count(video_count, 'video')}"


def _suggest_remedy(folder: Path) -> str:
    """Return advice about a folder that is not a capture, to append to the error message."""
    if not folder.is_dir():
        return ""
    for subfolder in sorted(path for path in folder.iterdir() if path.is_dir()):
        if not all(layout.find_missing_files(subfolder) for layout in LAYOUTS):
            return f". Its subfolder {subfolder.name} is a capture: use {subfolder}"
    video_count = max(len(list_videos(folder / name)) for name in ("", "videos"))
    folder_count = max(len(list_picture_folders(folder / name)) for name in ("", "images"))
    if max(video_count, folder_count) < 2:
        return describe_nested_videos(folder) or describe_unsupported_files(folder)
    contents = (
        f"{video_count} videos"
        if video_count >= folder_count
        else f"{folder_count} folders of pictures"
    )
    return (
        f". It has {contents} without poses; to find the poses, run: quarc-ref calibrate {folder} "
        "-o CAPTURE"
    )
