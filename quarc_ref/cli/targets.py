"""What the command makes: written beside its target, and put in its place when whole."""

import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from fnmatch import fnmatchcase
from pathlib import Path
from typing import BinaryIO

from quarc_ref.cli.faults import UsageError
from quarc_ref.cli.options import STANDARD_STREAM


@contextmanager
def written_file(target: Path, *, force: bool) -> Iterator[BinaryIO]:
    """Open a file beside a target, and put it in the target's place when all is written.

    Raises:
        UsageError: The target is `-`, or exists and is not to be replaced.
    """
    refuse_target(target, force=force)
    beside = _beside(target, "part")
    try:
        with beside.open("wb") as sink:
            yield sink
        beside.replace(target)
    finally:
        beside.unlink(missing_ok=True)


@contextmanager
def written_stream(target: Path, *, force: bool) -> Iterator[BinaryIO]:
    """Open what a stream is written to.

    Args:
        target: A file, or `-` for standard output.
        force: Whether to replace a file.

    Raises:
        UsageError: The target cannot be written so.
    """
    if str(target) == STANDARD_STREAM:
        if sys.stdout.isatty():
            message = "a stream on standard output needs a pipe or a file behind it"
            raise UsageError(message)
        yield sys.stdout.buffer
    else:
        with written_file(target, force=force) as sink:
            yield sink


@contextmanager
def _said_to_stay(target: Path) -> Iterator[None]:
    """Let an interruption say that what has been written is kept."""
    try:
        yield
    except KeyboardInterrupt as error:
        if not any(target.iterdir()):
            raise
        message = f"interrupted; {target} holds the frames that were written"
        raise KeyboardInterrupt(message) from error


@contextmanager
def grown_folder(target: Path, made: tuple[str, ...], *, force: bool) -> Iterator[Path]:
    """Make a folder, empty, whose files are seen as soon as they are made, and stay.

    Args:
        target: Where the folder is to be.
        made: As `written_folder` has it.
        force: Whether to replace what was made in it before.

    Raises:
        UsageError: The target is `-`, or holds something and is not to be replaced.
    """
    _refuse_folder(target, made, force=force)
    target.mkdir(exist_ok=True)
    for path in target.iterdir():
        path.unlink()
    try:
        with _said_to_stay(target):
            yield target
    finally:
        with suppress(OSError):  # nothing was made
            target.rmdir()


def put_file(path: Path, data: bytes) -> None:
    """Write a small file, which is seen only once it is whole."""
    beside = _beside(path, "part")
    try:
        beside.write_bytes(data)
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


@contextmanager
def written_folder(target: Path, made: tuple[str, ...], *, force: bool) -> Iterator[Path]:
    """Make a folder beside a target, and put it in the target's place when all is written.

    Args:
        target: Where the folder is to be.
        made: Patterns of the names that are made in it. A folder that holds
            anything else is not replaced, `force` or not.
        force: Whether to replace a folder.

    Raises:
        UsageError: The target is `-`, or holds something and is not to be replaced.
    """
    _refuse_folder(target, made, force=force)
    beside = _beside(target, "part")
    beside.mkdir()
    try:
        yield beside
        _put_in_place(beside, target)
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def refuse_target(target: Path, *, force: bool) -> None:
    """Raise UsageError if a file may not be put in a place."""
    _refuse_standard_output(target, "this file")
    _refuse_existing(target, force=force)
    if target.is_dir():
        message = f"{target} is a folder"
        raise UsageError(message)


def _refuse_folder(target: Path, made: tuple[str, ...], *, force: bool) -> None:
    """Raise UsageError if a folder may not be made in a place."""
    _refuse_standard_output(target, "a folder")
    _refuse_existing(target, force=force or _is_empty_folder(target))
    refuse_foreign(target, made)


def _refuse_standard_output(target: Path, what: str) -> None:
    if str(target) == STANDARD_STREAM:
        message = f"-: {what} cannot go to standard output"
        raise UsageError(message)


def _refuse_existing(target: Path, *, force: bool) -> None:
    if not target.absolute().parent.is_dir():
        message = f"{target.absolute().parent} is no folder"
        raise UsageError(message)
    if os.path.lexists(target) and not force:
        message = f"{target} exists; --force replaces it"
        raise UsageError(message)


def refuse_foreign(target: Path, made: tuple[str, ...]) -> None:
    """Raise UsageError if a folder holds what was not made in it."""
    if not os.path.lexists(target):
        return
    if target.is_symlink() or not target.is_dir():
        message = f"{target} is no folder of its own; --force replaces nothing else"
        raise UsageError(message)
    names = sorted(path.name for path in target.iterdir())
    foreign = [name for name in names if not any(fnmatchcase(name, each) for each in made)]
    if foreign:
        message = f"{target} also holds {foreign[0]}, which --force would remove: choose another"
        raise UsageError(message)


def _is_empty_folder(path: Path) -> bool:
    return path.is_dir() and not any(path.iterdir())


def _put_in_place(beside: Path, target: Path) -> None:
    if not target.exists():
        beside.rename(target)
        return
    aside = _beside(target, "old")
    target.rename(aside)
    try:
        beside.rename(target)
    except BaseException:
        aside.rename(target)
        raise
    shutil.rmtree(aside, ignore_errors=True)


def _beside(target: Path, purpose: str) -> Path:
    target = target.absolute()
    return target.with_name(f".{target.name}.{os.getpid()}.{purpose}")
