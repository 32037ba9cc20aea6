"""Opens output files and folders, and replaces existing ones only with `--force`."""

import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from quarc_ref import files
from quarc_ref.cli.errors import UsageError
from quarc_ref.cli.options import STANDARD_STREAM, is_path_name
from quarc_ref.cli.output import print_message
from quarc_ref.export.table import EXPORT_FORMATS
from quarc_ref.files import OutputFolder

# Suffixes that names of output folders must not have, because the folders would look like files.
_FILE_SUFFIXES = {
    *(f".{suffix}" for suffix in EXPORT_FORMATS),
    *(".quarc", ".splat", ".ksplat", ".gltf", ".usd", ".usda", ".usdz", ".html", ".json"),
    *(".mp4", ".mov", ".mkv", ".avi", ".webm", ".png", ".jpg", ".jpeg", ".gif", ".webp", ".tif"),
    *(
        ".obj",
        ".stl",
        ".fbx",
        ".xyz",
        ".pcd",
        ".las",
        ".laz",
        ".e57",
        ".npy",
        ".pt",
        ".pth",
        ".ckpt",
    ),
    *(".zip", ".tar", ".gz", ".7z", ".csv", ".txt"),
}


@contextmanager
def open_output_file(target: Path, *, force: bool, durable: bool = False) -> Iterator[BinaryIO]:
    """Open a temporary file that replaces a target when the block ends without an error.

    Args:
        target: Path of the file.
        force: Whether to replace an existing file.
        durable: Whether to flush the file to disk, so that it survives a power failure.

    Raises:
        UsageError: The target is `-`, or exists and must not be replaced.
    """
    require_writable_file(target, force=force)
    files.remove_leftovers(target)
    with files.atomic_file(target, durable=durable) as sink:
        yield sink


@contextmanager
def open_output_stream(target: Path, *, force: bool) -> Iterator[BinaryIO]:
    """Open the output file of a stream, or standard output.

    Args:
        target: Path of the file, or `-` for standard output.
        force: Whether to replace an existing file.

    Raises:
        UsageError: The file exists and must not be replaced, or standard output is a terminal or
            closed.
    """
    if str(target) == STANDARD_STREAM:
        # `sys.stdout` of a closed standard output is the null device (`ensure_standard_streams`).
        if sys.__stdout__ is None or sys.stdout.isatty():
            problem = "a terminal" if sys.__stdout__ else "closed"
            message = f"standard output is {problem}: redirect it to a pipe or a file"
            raise UsageError(message)
        with _report_incomplete_output():
            yield sys.stdout.buffer
    else:
        with open_output_file(target, force=force, durable=True) as sink:
            yield sink


@contextmanager
def written_folder(target: Path, *, force: bool) -> Iterator[OutputFolder]:
    """Yield a temporary folder, which replaces the target when the block ends without an error.

    Args:
        target: Path of the folder.
        force: Whether to replace a folder that quarc-ref created.

    Raises:
        UsageError: The target is `-`, or its name has the suffix of a file.
        OutputPathError: The target is not empty and must not be replaced.
    """
    _require_folder_path(target)
    with files.written_folder(target, replace=force) as folder:
        yield folder
    if folder.moved_to:
        message = (
            f"another program added files to {target} while quarc-ref was writing it; these files "
            f"are now in {folder.moved_to}"
        )
        print_message(message)


@contextmanager
def growing_folder(target: Path, *, force: bool) -> Iterator[OutputFolder]:
    """Yield the target folder, whose files are visible immediately, and remain after an error.

    Args:
        target: Path of the folder.
        force: Whether to replace a folder that quarc-ref created.

    Raises:
        UsageError: The target is `-`, or its name has the suffix of a file.
        OutputPathError: The target is not empty and must not be replaced.
    """
    _require_folder_path(target)
    with files.growing_folder(target, replace=force) as folder, _report_kept_files(folder):
        yield folder


class SingleFrameFile:
    """An output file for a single frame; a second frame is an error.

    Args:
        target: Path of the file.
        sink: Binary file for the frame.
    """

    def __init__(self, target: Path, sink: BinaryIO) -> None:
        self._target = target
        self._sink = sink
        self._has_frame = False

    def write(self, _name: str, data: bytes) -> Path:
        """Write the frame and return the path of the file.

        Raises:
            UsageError: The file already has a frame.
        """
        if self._has_frame:
            message = (
                f"{self._target} is a single file, but there are several frames or pictures: "
                "choose one frame, such as --frames 0:1, or give a folder"
            )
            raise UsageError(message)
        self._has_frame = True
        self._sink.write(data)
        return self._target


@contextmanager
def open_output_frame(target: Path, *, force: bool) -> Iterator[SingleFrameFile]:
    """Open a temporary file for one frame; it replaces a target when the block ends.

    Raises:
        UsageError: The target is `-`, or exists and must not be replaced.
    """
    with open_output_file(target, force=force) as sink:
        yield SingleFrameFile(target, sink)


def require_writable_file(target: Path, *, force: bool) -> None:
    """Raise UsageError if a file cannot be written, or if it exists and must not be replaced."""
    _reject_standard_output(target, "this file")
    _reject_missing_parent(target)
    reject_folder(target)
    if target.exists() and not target.is_file():
        message = f"{target} is a device or a pipe, not a regular file: give another path"
        raise UsageError(message)
    if os.path.lexists(target) and not force:  # last, because --force replaces only files
        message = f"{target} exists: use --force to replace it"
        raise UsageError(message)


def reject_folder(target: Path) -> None:
    """Raise UsageError if the path of an output file is that of a folder."""
    if target.is_dir():
        message = f"{target} is a folder: give the path of a file"
        raise UsageError(message)


def reject_input_folder(target: Path, inputs: Iterable[Path | None]) -> None:
    """Raise UsageError if an output folder would replace a file or folder that is read.

    Args:
        target: Path of the output folder.
        inputs: Paths of the inputs; None for inputs that are not given.
    """
    for path in inputs:
        if path is not None and path.resolve().is_relative_to(target.resolve()):
            message = f"{target} would replace the input {path}: choose another folder"
            raise UsageError(message)


def reject_input_stream(target: Path, name: str) -> None:
    """Raise UsageError if an output folder would replace the stream that is read.

    Args:
        target: Path of the output folder.
        name: Path or URL of the stream, or `-`.
    """
    reject_input_folder(target, [Path(name) if is_path_name(name) else None])


def _require_folder_path(target: Path) -> None:
    """Raise UsageError if the path of an output folder is `-` or has the suffix of a file."""
    _reject_standard_output(target, "a folder")
    _reject_missing_parent(target)
    if target.suffix.lower() in _FILE_SUFFIXES:
        message = (
            f"{target} must be a folder, but its name has the suffix of a file: choose a name "
            f"without {target.suffix}"
        )
        raise UsageError(message)


def _reject_standard_output(target: Path, output_name: str) -> None:
    if str(target) == STANDARD_STREAM:
        message = f"{output_name} cannot be written to standard output (-): give a path"
        raise UsageError(message)


def _reject_missing_parent(target: Path) -> None:
    if not target.absolute().parent.is_dir():
        message = f"{target.absolute().parent} is not a folder: create the folder first"
        raise UsageError(message)


@contextmanager
def _report_incomplete_output() -> Iterator[None]:
    """If the block is interrupted, say that standard output may have a part of the stream."""
    try:
        yield
    except KeyboardInterrupt as error:
        message = "interrupted; the stream on standard output is incomplete"
        raise KeyboardInterrupt(message) from error


@contextmanager
def _report_kept_files(folder: OutputFolder) -> Iterator[None]:
    """If the block is interrupted, add the folder of the finished frames to the error message."""
    try:
        yield
    except KeyboardInterrupt as error:
        if folder.has_old_files or not folder.contains_files():
            raise
        message = f"interrupted; {folder.path} contains the finished frames"
        raise KeyboardInterrupt(message) from error
