"""Encodes to a file that is locked against other encodes."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

from quarc_ref.datasets.capture import Capture
from quarc_ref.encoder.encode_options import EncodeOptions
from quarc_ref.encoder.encode_stream import encode
from quarc_ref.encoder.resume.checkpoint import checkpoint_path
from quarc_ref.encoder.resume.partial_stream import read_partial_stream
from quarc_ref.files.locks import is_still_at, lock, open_regular
from quarc_ref.format.errors import ResumeError
from quarc_ref.streams.sources import FileSource


def encode_file(capture: Capture, path: Path, options: EncodeOptions) -> None:
    """Encode a capture to a file, or resume a partial stream in it.

    After an interruption, another call resumes the encode and produces the same bytes. A
    file with the complete stream is left unchanged. Until frame 0 is written, its
    training is saved in a checkpoint next to the file (`checkpoint_path`).

    Args:
        capture: Multi-view video.
        path: Path of the file, which is created if missing.
        options: Options; the checkpoint is set here.

    Raises:
        CaptureError: A picture cannot be read.
        EncodeError: The scene cannot be written with these settings.
        BitstreamError: The file is not a stream.
        ResumeError: The file has a stream of another encode, or is
            being written by another process.
        OutputPathError: The path is a symbolic link, or not a regular file.
    """
    with open_exclusively(path) as file:
        encode_into(capture, file, path, options)


def encode_into(capture: Capture, file: BinaryIO, path: Path, options: EncodeOptions) -> None:
    """Like `encode_file`, with a file from `open_exclusively`.

    Args:
        capture: Multi-view video.
        file: File that is open for reading and writing.
        path: Path of the file.
        options: Options, as for `encode_file`.

    Raises:
        CaptureError: See `encode_file`.
        EncodeError: See `encode_file`.
        BitstreamError: See `encode_file`.
        ResumeError: The file has a stream of another encode.
    """
    existing = read_partial_stream(FileSource(file))
    if existing is None:
        file.truncate(file.seek(0))
    encode(capture, file, replace(options, checkpoint=checkpoint_path(path)), existing)


@contextmanager
def open_exclusively(path: Path) -> Iterator[BinaryIO]:
    """Open a file for reading and writing, and lock it against other encodes.

    The file is created if it is missing. Rejected files are left unchanged.

    Raises:
        ResumeError: Another process has the file open.
        OutputPathError: The path is a symbolic link, or not a regular file.
        OSError: The file cannot be opened.
    """
    while True:
        with open_regular(path, os.O_RDWR | os.O_CREAT) as file:
            if lock(file) is False:
                message = f"{path} is being written by another process"
                raise ResumeError(message)
            if is_still_at(file, path):
                yield file
                return
