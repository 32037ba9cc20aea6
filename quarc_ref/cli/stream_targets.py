"""Output files of `encode`, which are kept after an interruption, so that `--resume` works."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, NoReturn

from quarc_ref.cli.errors import UsageError
from quarc_ref.cli.targets import reject_target
from quarc_ref.files import OutputFolder, contains_files, growing_folder, sync_file, sync_folder

_PART = ".part"
_SEGMENTS = ".segments"


@contextmanager
def growing_stream(
    target: Path, *, force: bool, live: bool, resume: bool
) -> Iterator[tuple[Path, BinaryIO]]:
    """Open the output file of a stream exclusively; the file may contain a partial stream.

    The file is `<target>.part`, and replaces the target when the stream is complete. After an
    interruption, the file and the checkpoint of frame 0 are kept, unless the file is empty.

    Args:
        target: Path of the stream.
        force: Whether to replace an existing target or partial stream.
        live: Whether to write the target directly, so that other programs can follow the stream.
        resume: Whether to continue the partial stream, or the target if the stream is complete.

    Yields:
        Path of the file that is written, and the file object, open for reading and writing.

    Raises:
        UsageError: The target or a partial stream exists, and neither `force` nor `resume` is set.
        ResumeError: Another process is writing the file.
    """
    from quarc_ref.encoder.stream_file import open_exclusively

    place = _choose_resumed(target, live=live) if resume else _choose_new(target, live=live)
    reject_target(target, force=force or (resume and place == target))
    if force and not resume:
        _remove(place)
    with open_exclusively(place) as file:
        try:
            if not resume:
                _reject_existing_part(place)
            with _reporting_kept_files(place):
                yield place, file
            sync_file(file)
        finally:
            if not _is_nonempty(place):
                _drop(place, file)
    if place != target:
        place.replace(target)
    sync_folder(target.absolute().parent)


@contextmanager
def kept_segments(target: Path, *, force: bool, resume: bool) -> Iterator[OutputFolder]:
    """Create the folder `<target>.segments`, which is removed on success and kept otherwise.

    Args:
        target: Path of the joined stream.
        force: Whether to replace an existing target or existing segments.
        resume: Whether to continue with existing segments.

    Raises:
        UsageError: The target cannot be written, or segments exist and neither `force` nor `resume`
            is set.
        OutputPathError: The folder has files that quarc-ref did not create, or is in use.
    """
    reject_target(target, force=force)
    path = target.with_name(target.name + _SEGMENTS)
    with growing_folder(path, replace=True, keep=resume or not force) as folder:
        if not (resume or force) and folder.contains_files():
            _reject_leftover(path)
        with _reporting_kept_files(path):
            yield folder
        folder.empty()


@contextmanager
def _reporting_kept_files(place: Path) -> Iterator[None]:
    """Add the names of the kept files to the message of an interruption."""
    try:
        yield
    except KeyboardInterrupt as error:
        training = _name_training(place)
        if _is_nonempty(place):
            kept = f"{place} has the finished frames: use --resume to encode the missing frames"
        elif _is_nonempty(training):
            kept = f"{training} has the training state of frame 0: use --resume to continue"
        else:
            raise
        message = f"interrupted; {kept}"
        raise KeyboardInterrupt(message) from error


def _choose_new(target: Path, *, live: bool) -> Path:
    return target if live else _name_part(target)


def _choose_resumed(target: Path, *, live: bool) -> Path:
    part = _name_part(target)
    at_target = live or (_is_nonempty(target) and not _has_partial_encode(part))
    return target if at_target else part


def _remove(place: Path) -> None:
    """Remove a partial stream and its checkpoint, unless another process is writing the stream."""
    from quarc_ref.encoder.resume.checkpoint import remove_checkpoint
    from quarc_ref.encoder.stream_file import open_exclusively

    with open_exclusively(place) as file:
        remove_checkpoint(_name_training(place))
        _drop(place, file)


def _drop(place: Path, file: BinaryIO) -> None:
    """Remove an open file, or truncate it on systems that cannot remove open files."""
    if sys.platform == "win32":
        file.truncate(0)
    else:
        place.unlink(missing_ok=True)


def _reject_existing_part(place: Path) -> None:
    for path in (place, _name_training(place)):
        if _is_nonempty(path):
            _reject_leftover(path)


def _reject_leftover(place: Path) -> NoReturn:
    message = (
        f"{place} is from an interrupted encode: use --resume to continue the encode, or --force "
        "to start again"
    )
    raise UsageError(message)


def _name_training(place: Path) -> Path:
    from quarc_ref.encoder.resume.checkpoint import checkpoint_path

    return checkpoint_path(place)


def _name_part(target: Path) -> Path:
    return target.with_name(target.name + _PART)


def _has_partial_encode(place: Path) -> bool:
    return any(map(_is_nonempty, (place, _name_training(place))))


def _is_nonempty(path: Path) -> bool:
    if path.is_dir():
        return contains_files(path)
    return path.is_file() and path.stat().st_size > 0
