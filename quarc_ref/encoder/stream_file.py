"""Encodes to a file that is locked, so that no other encode writes to it."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

from quarc_ref.datasets.capture import Capture
from quarc_ref.encoder.description import describe_encode
from quarc_ref.encoder.encode_options import EncodeOptions
from quarc_ref.encoder.encode_stream import encode
from quarc_ref.encoder.resume.checkpoint import checkpoint_path
from quarc_ref.encoder.resume.differences import name_stream
from quarc_ref.encoder.resume.partial_stream import read_partial_stream, require_match
from quarc_ref.files.locks import is_still_at, lock_file, open_regular_file
from quarc_ref.format.errors import ResumeError
from quarc_ref.streams.sources import FileSource


def encode_file(capture: Capture, path: Path, options: EncodeOptions) -> None:
    """Encode a capture to a file, or resume the partial stream in the file.

    After an interruption, another call resumes the encode and produces the same bytes as an
    uninterrupted encode. A file with the complete stream is not changed. Until frame 0 is
    written, the state of its training is saved in a checkpoint in the same folder
    (`checkpoint_path`).

    Args:
        capture: Multi-view video.
        path: Path of the file, which is created if it does not exist.
        options: Options of the encode; `checkpoint` is ignored.

    Raises:
        CaptureError: A picture cannot be read.
        EncodeError: The format cannot represent the scene with these settings.
        BitstreamError: The file does not contain a stream.
        ResumeError: The file contains a stream of another encode, or another process is
            writing the file.
        OutputPathError: The path is a symbolic link or is not a regular file.
    """
    with open_exclusively(path) as file:
        try:
            encode_into(capture, file, path, options)
        finally:
            remove_if_empty(path)


def encode_into(capture: Capture, file: BinaryIO, path: Path, options: EncodeOptions) -> None:
    """Encode a capture like `encode_file`, to a file that `open_exclusively` has opened.

    Args:
        capture: Multi-view video.
        file: The file, open for reading and writing.
        path: Path of the file, which determines the path of the checkpoint.
        options: Options of the encode; `checkpoint` is ignored.

    Raises:
        CaptureError: See `encode_file`.
        EncodeError: See `encode_file`.
        BitstreamError: See `encode_file`.
        ResumeError: The file contains a stream of another encode.
    """
    with name_stream(path):
        partial_stream = read_partial_stream(FileSource(file))
        if partial_stream is not None and not partial_stream.frames:
            metadata = describe_encode(capture, options.config, options.device)
            require_match(partial_stream, partial_stream.header, capture.cameras, metadata)
            partial_stream = None
        if partial_stream is None:
            file.truncate(file.seek(0))
        encode(capture, file, replace(options, checkpoint=checkpoint_path(path)), partial_stream)


def remove_if_empty(path: Path) -> None:
    """Remove a file without content, unless it is open on a system that cannot remove it then."""
    if sys.platform != "win32" and path.is_file() and path.stat().st_size == 0:
        path.unlink()


@contextmanager
def open_exclusively(path: Path) -> Iterator[BinaryIO]:
    """Open a file for reading and writing, and lock it so that no other encode writes to it.

    The file is created if it does not exist. If the file is rejected, it is not changed.

    Raises:
        ResumeError: Another process has locked the file.
        OutputPathError: The path is a symbolic link or is not a regular file.
        OSError: The file cannot be opened.
    """
    while True:
        with open_regular_file(path, os.O_RDWR | os.O_CREAT) as file:
            if lock_file(file) is False:
                message = f"{path} is being written by another process"
                raise ResumeError(message)
            if is_still_at(file, path):
                yield file
                return
