"""Writes a folder that any web server can serve: a page, the player, a stream and a poster."""

from collections.abc import Callable
from dataclasses import dataclass

from quarc_ref.files import OutputFolder
from quarc_ref.streams import FileSource, Source
from quarc_ref.streams.copy_stream import copy_stream
from quarc_ref.viewing.page import (
    PLAYER_FILE,
    POSTER_FILE,
    STREAM_FILE,
    PageOptions,
    build_page,
    read_player,
)

_PAGE_FILE = "index.html"


@dataclass(frozen=True, slots=True)
class Site:
    """Contents of the folder that `write_site` wrote.

    Attributes:
        file_names: Names of the files.
        frame_count: Number of frames in the stream.
        stream_bytes: Size of the stream, bytes.
        poster_name: File name of the poster; None if there is none.
    """

    file_names: list[str]
    frame_count: int
    stream_bytes: int
    poster_name: str | None


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
    contents = {
        _PAGE_FILE: build_page(options, has_poster=poster is not None, url=url),
        PLAYER_FILE: read_player(),
        **({POSTER_FILE: poster} if poster else {}),
    }
    for name, data in contents.items():
        folder.write(name, data)
    return Site(
        sorted([*contents, STREAM_FILE]),
        frame_count,
        path.stat().st_size,
        POSTER_FILE if poster else None,
    )
