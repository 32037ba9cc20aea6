"""Encodes into a file, one encode at a time."""

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
from quarc_ref.files.locks import is_at, lock, open_regular
from quarc_ref.format.errors import ResumeError
from quarc_ref.streams.sources import FileSource


def encode_file(capture: Capture, path: Path, options: EncodeOptions) -> None:
    """Encode a capture into a file, resuming a partial stream in it.

    After any interruption, another call resumes the file and ends with the same
    bytes. A file that holds the whole stream is left unchanged. Until frame 0 is written, its
    training is saved in a file beside it (`checkpoint_path`).

    Args:
        capture: As `encode` takes it.
        path: Path of the file, which is created if missing.
        options: Settings; the checkpoint is chosen here.

    Raises:
        CaptureError: A picture cannot be read.
        EncodeError: The scene cannot be written with these settings.
        BitstreamError: The file is not a stream.
        ResumeError: The file has a stream of another encode, or is
            being written by another process.
        OutputPathError: It is a symbolic link, or not a regular file.
    """
    with open_exclusively(path) as file:
        encode_into(capture, file, path, options)


def encode_into(capture: Capture, file: BinaryIO, path: Path, options: EncodeOptions) -> None:
    """Like `encode_file`, with a file from `open_exclusively`.

    Args:
        capture: As `encode` takes it.
        file: Opened to be read and written.
        path: Where it is.
        options: As for `encode_file`.

    Raises:
        CaptureError: As for `encode_file`, and so all that follows.
        EncodeError: See there.
        BitstreamError: See there.
        ResumeError: The file has a stream of another encode.
    """
    existing = read_partial_stream(FileSource(file))
    if existing is None:
        file.truncate(file.seek(0))
    encode(capture, file, replace(options, checkpoint=checkpoint_path(path)), existing)


@contextmanager
def open_exclusively(path: Path) -> Iterator[BinaryIO]:
    """Open a file for reading and writing, locked against other encodes.

    It is created if missing. A file that is rejected is left unchanged.

    Raises:
        ResumeError: Another process has it open.
        OutputPathError: It is a symbolic link, or not a regular file.
        OSError: It cannot be opened.
    """
    while True:
        with open_regular(path, os.O_RDWR | os.O_CREAT) as file:
            if lock(file) is False:
                message = f"{path} is being written by another process"
                raise ResumeError(message)
            if is_at(file, path):
                yield file
                return
