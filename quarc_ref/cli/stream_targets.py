"""Output files of `encode`, which are kept after an interruption, so that `--resume` works."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, NoReturn

from quarc_ref.cli.errors import UsageError
from quarc_ref.cli.targets import reject_folder, require_writable_file
from quarc_ref.files import (
    MARKER_NAME,
    OutputFolder,
    growing_folder,
    name_full_disk,
    sync_file,
    sync_folder,
)
from quarc_ref.format.errors import BitstreamError, ResumeError

_PART_SUFFIX = ".part"
_SEGMENTS_SUFFIX = ".segments"
_UNREADABLE_ADVICE = (
    ", or with a smaller --frames to leave them out, or with ignored_frames in quarc-capture.json "
    "(quarc-ref doctor prints them) to use only the other cameras"
)


@contextmanager
def checked_stream_path(target: Path, *, force: bool, live: bool, resume: bool) -> Iterator[None]:
    """Check that `open_stream_file` can open a file, before a block that opens the capture.

    No file is changed, so that a wrong option does not cost the results of earlier encodes.

    Args:
        target: See `open_stream_file`.
        force: See `open_stream_file`.
        live: See `open_stream_file`.
        resume: See `open_stream_file`.

    Raises:
        UsageError: See `open_stream_file`.
        ResumeError: See `open_stream_file`.
    """
    from quarc_ref.encoder.stream_file import open_exclusively

    path = _choose_path(target, force=force, live=live, resume=resume)
    if os.path.lexists(path):
        with open_exclusively(path):
            pass
    if not (force or resume):
        _reject_partial_stream(path)
    with _report_kept_files(path):
        yield


@contextmanager
def open_stream_file(
    target: Path, *, force: bool, live: bool, resume: bool
) -> Iterator[tuple[Path, BinaryIO]]:
    """Open the output file of a stream exclusively; the file may contain a partial stream.

    Unless `live` is set, the file is `<target>.part`, and replaces the target when the stream is
    complete. After an interruption, the checkpoint of frame 0 is kept, and so is the file unless it
    is empty.

    Args:
        target: Path of the stream.
        force: Whether to replace an existing target or partial stream.
        live: Whether to write the target directly, so that other programs can follow the stream.
        resume: Whether to continue a partial stream or, if there is none, an existing target.

    Yields:
        Path of the file that is written, and the file object, open for reading and writing.

    Raises:
        UsageError: The target or a partial stream exists, and neither `force` nor `resume` is set.
        ResumeError: Another process is writing the file.
    """
    from quarc_ref.encoder.stream_file import open_exclusively, remove_if_empty

    path = _choose_path(target, force=force, live=live, resume=resume)
    if force and not resume:
        _remove_partial_stream(path)
    with open_exclusively(path) as file:
        try:
            if not resume:
                _reject_partial_stream(path)
            with _report_kept_files(path), name_full_disk(path):
                yield path, file
                sync_file(file)
        finally:
            remove_if_empty(path)
    if path != target:
        path.replace(target)
    sync_folder(target.absolute().parent)


@contextmanager
def open_segments_folder(target: Path, *, force: bool, resume: bool) -> Iterator[OutputFolder]:
    """Create the folder `<target>.segments`, which is removed on success and kept otherwise.

    Existing segments that are replaced stay until the first new segment is registered.

    Args:
        target: Path of the joined stream.
        force: Whether to replace an existing target or existing segments.
        resume: Whether to continue with existing segments.

    Raises:
        UsageError: The target cannot be written; a partial stream exists, and `force` is not set;
            or segments exist, and neither `force` nor `resume` is set.
        OutputPathError: The folder has files that quarc-ref did not create, or is in use.
    """
    require_writable_file(target, force=force)
    if not force:
        _reject_other_encode(_get_part_path(target), "without --segments")
    path = _get_segments_path(target)
    with growing_folder(path, replace=True, keep=resume or not force) as folder:
        if not (resume or force) and folder.contains_files():
            _reject_leftover(path)
        with _report_kept_files(path):
            yield folder
        folder.remove_files()


def remove_partial_stream(target: Path) -> None:
    """Remove what an interrupted encode to `target`, without segments and `--live`, left.

    Raises:
        ResumeError: Another process is writing the partial stream.
    """
    _remove_partial_stream(_get_part_path(target))


@contextmanager
def _report_kept_files(path: Path) -> Iterator[None]:
    """Add what is kept to the message of an interruption or error, such as a full disk.

    Args:
        path: The file that the block writes, or the folder of the segments.
    """
    from quarc_ref.datasets.errors import CaptureError
    from quarc_ref.jobs import JobsError

    try:
        yield
    except KeyboardInterrupt as error:
        kept_files = _describe_kept_files(path)
        if not kept_files:
            raise
        message = f"interrupted; {kept_files}"
        raise KeyboardInterrupt(message) from error
    except (CaptureError, JobsError, OSError) as error:
        is_unreadable = isinstance(error, CaptureError)
        alternative = _UNREADABLE_ADVICE if is_unreadable else ""
        kept_files = _describe_kept_files(path, alternative)
        if kept_files:
            _append_to_message(error, kept_files)
        raise


def _append_to_message(error: Exception, text: str) -> None:
    if isinstance(error, OSError) and error.strerror:
        error.strerror = f"{error.strerror}; {text}"
    else:
        error.args = (f"{error}; {text}",)


def _describe_kept_files(path: Path, alternative: str = "") -> str:
    """Return which files `--resume` can use, and how; empty if there are none.

    Args:
        path: The file or folder of an encode.
        alternative: What to append to the advice about missing frames.
    """
    files = sorted(path.iterdir()) if path.is_dir() else [path, _get_checkpoint_path(path)]
    kept_files = [file for file in files if file.name != MARKER_NAME and _is_nonempty(file)]
    checkpoints = [
        file for file in kept_files if file == _get_checkpoint_path(file.with_suffix(""))
    ]
    if len(kept_files) > len(checkpoints):
        advice = f"use --resume to encode the missing frames{alternative}"
        return f"{path} contains the finished frames: {advice}"
    if checkpoints:
        place = path if path.is_dir() else checkpoints[0]
        return f"{place} contains the training state of frame 0: use --resume to continue"
    return ""


def reject_stream_path(path: Path, target: Path) -> None:
    """Raise UsageError if a log would overwrite a file of an encode to `target`."""
    part_path = _get_part_path(target)
    stream_paths = (target, part_path)
    encode_paths = (*stream_paths, *map(_get_checkpoint_path, stream_paths))
    if path.resolve() in (encode_path.resolve() for encode_path in encode_paths):
        message = f"--log-json {path} is a file of the encode to {target}: choose another file"
        raise UsageError(message)


def _choose_path(target: Path, *, force: bool, live: bool, resume: bool) -> Path:
    """Return the file that an encode writes; see `open_stream_file`.

    Raises:
        UsageError: The target must not be replaced, or `resume` continues another file.
    """
    if resume:
        path = _choose_resumed_path(target, live=live)
    else:
        path = target if live else _get_part_path(target)
        if not force:
            _reject_incomplete_stream(target)
    require_writable_file(target, force=force or (resume and path == target))
    return path


def _choose_resumed_path(target: Path, *, live: bool) -> Path:
    """Return the file in which an interrupted encode, with or without `--live`, left its frames.

    Raises:
        UsageError: The interrupted encode was not live, but `live` is set, or it had segments.
    """
    part_path = _get_part_path(target)
    if live:
        _reject_other_encode(part_path, "without --live")
    has_part = _has_partial_encode(part_path)
    if not (has_part or _has_partial_encode(target)):
        _reject_other_encode(_get_segments_path(target), "with --segments")
    is_target_resumed = live or (_has_partial_encode(target) and not has_part)
    return target if is_target_resumed else part_path


def _remove_partial_stream(path: Path) -> None:
    """Remove a partial stream and its checkpoint, unless another process is writing the stream."""
    from quarc_ref.encoder.resume.checkpoint import remove_checkpoint
    from quarc_ref.encoder.stream_file import open_exclusively

    with open_exclusively(path) as file:
        remove_checkpoint(_get_checkpoint_path(path))
        _remove_open_file(path, file)


def _remove_open_file(path: Path, file: BinaryIO) -> None:
    """Remove an open file, or truncate it on systems that cannot remove open files."""
    if sys.platform == "win32":
        file.truncate(0)
    else:
        path.unlink(missing_ok=True)


def _reject_partial_stream(part_path: Path) -> None:
    for path in (part_path, _get_checkpoint_path(part_path)):
        if _is_nonempty(path):
            _reject_leftover(path)


def _reject_incomplete_stream(target: Path) -> None:
    """Raise UsageError if a file is an incomplete stream, such as that of a live encode."""
    from quarc_ref.encoder.resume.partial_stream import read_partial_stream
    from quarc_ref.streams.sources import FileSource

    stream = None
    if target.is_file():
        with suppress(BitstreamError, OSError, ResumeError), target.open("rb") as file:
            stream = read_partial_stream(FileSource(file))
    if stream is not None and not stream.is_finished:
        message = (
            f"{target} is incomplete: use --resume to continue its encode, or --force to start "
            "again"
        )
        raise UsageError(message)


def _reject_other_encode(path: Path, how: str) -> None:
    """Raise UsageError if a file or folder is from an encode that only other options resume."""
    if _describe_kept_files(path):
        message = (
            f"{path} is from an interrupted encode {how}: use --resume {how} to continue the "
            "encode, or delete it"
        )
        raise UsageError(message)


def _reject_leftover(path: Path) -> NoReturn:
    message = (
        f"{path} is from an interrupted encode: use --resume to continue the encode, or --force "
        "to start again"
    )
    raise UsageError(message)


def _get_checkpoint_path(path: Path) -> Path:
    from quarc_ref.encoder.resume.checkpoint import checkpoint_path

    return checkpoint_path(path)


def _get_part_path(target: Path) -> Path:
    reject_folder(target)  # `.` and `/` have no name to which a suffix can be added
    return target.with_name(target.name + _PART_SUFFIX)


def _get_segments_path(target: Path) -> Path:
    return target.with_name(target.name + _SEGMENTS_SUFFIX)


def _has_partial_encode(path: Path) -> bool:
    return any(map(_is_nonempty, (path, _get_checkpoint_path(path))))


def _is_nonempty(path: Path) -> bool:
    return path.is_file() and path.stat().st_size > 0
