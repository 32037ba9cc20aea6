"""Writes a page with player, stream, poster and audio: a folder for servers, or one HTML file."""

import io
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, BinaryIO

from quarc_ref.files import OutputFolder
from quarc_ref.streams import BytesSource, FileSource, Source
from quarc_ref.streams.copy_stream import copy_stream
from quarc_ref.viewing.page import (
    PLAYER_FILE,
    POSTER_FILE,
    STREAM_FILE,
    PageOptions,
    build_page,
    build_single_page,
    read_player,
)

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

_PAGE_FILE = "index.html"


# Chromium and Firefox read data URLs of up to 512 MB, a third more than the bytes that they encode.
SINGLE_PAGE_LIMIT = 350_000_000


class SinglePageError(ValueError):
    """A stream is too large for a single page."""


@dataclass(frozen=True, slots=True)
class Site:
    """What `write_site` or `write_single_page` wrote.

    Attributes:
        file_names: Names of the files in the folder; empty for a single page.
        frame_count: Number of frames in the stream.
        stream_bytes: Size of the stream, bytes.
        poster_name: Name of the poster in the folder; None if there is none.
        audio_name: Name of the audio file in the folder; None if there is none.
    """

    file_names: list[str]
    frame_count: int
    stream_bytes: int
    poster_name: str | None
    audio_name: str | None


def write_site(
    folder: OutputFolder,
    source: Source,
    options: PageOptions,
    draw_poster: Callable[[Source], bytes | None],
    url: str | None = None,
) -> Site:
    """Write a site to a folder.

    Args:
        folder: Output folder.
        source: The stream, which may be a pipe.
        options: Options of the page.
        draw_poster: Function that returns a JPEG file for a stream, or None to omit the poster.
        url: URL at which the folder will be served; None if unknown.

    Raises:
        BitstreamError: The stream is invalid; every chunk is checked.
        SourceError: The file, pipe or server cannot be read.
    """
    with folder.open(STREAM_FILE) as sink:
        frame_count = copy_stream(source, sink)
    path = folder.path / STREAM_FILE
    with path.open("rb", buffering=0) as file:
        poster = draw_poster(FileSource(file))
    audio = options.audio
    contents = {
        _PAGE_FILE: build_page(options, has_poster=poster is not None, url=url),
        PLAYER_FILE: read_player(),
        **({POSTER_FILE: poster} if poster else {}),
        **({audio.name: audio.data} if audio else {}),
    }
    for name, data in contents.items():
        folder.write(name, data)
    return Site(
        sorted([*contents, STREAM_FILE]),
        frame_count,
        path.stat().st_size,
        POSTER_FILE if poster else None,
        audio.name if audio else None,
    )


def write_single_page(
    sink: BinaryIO,
    source: Source,
    options: PageOptions,
    draw_poster: Callable[[Source], bytes | None],
) -> Site:
    """Write a page that contains player, stream and poster, and that also opens from a local file.

    Args:
        sink: Binary file for the page.
        source: The stream, which may be a pipe.
        options: Options of the page.
        draw_poster: Function that returns a JPEG file for a stream, or None to omit the poster.

    Raises:
        SinglePageError: The stream or the audio file has more than SINGLE_PAGE_LIMIT bytes.
        BitstreamError: The stream is invalid; every chunk is checked.
        SourceError: The file, pipe or server cannot be read.
    """
    if options.audio and len(options.audio.data) > SINGLE_PAGE_LIMIT:
        raise SinglePageError(_describe_limit("the audio file"))
    copy = _LimitedBuffer()
    frame_count = copy_stream(source, copy)
    stream = copy.getvalue()
    poster = draw_poster(BytesSource(stream))
    sink.write(build_single_page(options, stream, poster))
    return Site([], frame_count, len(stream), None, None)


class _LimitedBuffer(io.BytesIO):
    """A buffer that rejects what does not fit into a single page, before memory runs out."""

    def write(self, data: "ReadableBuffer", /) -> int:
        if self.tell() + memoryview(data).nbytes > SINGLE_PAGE_LIMIT:
            raise SinglePageError(_describe_limit("the stream"))
        return super().write(data)


def _describe_limit(name: str) -> str:
    return (
        f"a single page can contain at most {SINGLE_PAGE_LIMIT // 1_000_000} MB, and {name} is "
        "larger: give the name of a folder"
    )
