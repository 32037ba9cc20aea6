"""The verb `view`: a stream on a page of a browser."""

import sys
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from threading import Event
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from quarc_ref.cli.errors import UsageError, report_errors
from quarc_ref.cli.options import AsJson, StreamName, name_stream
from quarc_ref.cli.output import print_json, print_table, warn_of_reference_engine
from quarc_ref.cli.seekable_stream import seekable_stream

if TYPE_CHECKING:
    from quarc_ref.streams import Source
    from quarc_ref.viewing.page import Page

_MEBIBYTE = 1 << 20


def view(
    file: StreamName,
    host: Annotated[
        str, typer.Option("--host", help="Address to listen at; 0.0.0.0 lets others in.")
    ] = "127.0.0.1",
    port: Annotated[
        int, typer.Option("--port", min=1, max=65535, help="The first of those to try.")
    ] = 8080,
    allowed: Annotated[
        list[str] | None,
        typer.Option(
            "--allow-host",
            metavar="NAME",
            help="Answer to this name too, for a reverse proxy or a tunnel; may be repeated.",
            show_default=False,
        ),
    ] = None,
    open_browser: Annotated[
        bool, typer.Option("--open/--no-open", help="Open the page in a browser.")
    ] = True,
    playing: Annotated[
        bool, typer.Option("--play/--no-play", help="Begin at once, or stand on the first frame.")
    ] = True,
    memory: Annotated[
        int, typer.Option("--memory", min=1, metavar="MIB", help="For frames that are decoded.")
    ] = 512,
    as_json: AsJson = False,
) -> None:
    """Play a stream in a browser: timeline, cameras, bytes of every frame. Ctrl-C ends it.

    The page is for those who have its address, whose key is a new one every time.
    A Gaussian has one color at a time, as seen by whoever moved last; `render`
    draws exactly.
    """
    with report_errors():
        from quarc_ref.streams import open_source

        title, place = name_stream(file), _Place((host, port), _require_names(allowed or []))
        with (
            open_source(file) as opened,
            suppress(KeyboardInterrupt),
            seekable_stream(opened) as source,
            _open_page(source, title, place, playing=playing) as (page, run),
        ):
            _announce(title, page.url, as_json=as_json, open_browser=open_browser)
            run(memory * _MEBIBYTE, Event())


class _Place(NamedTuple):
    """Where a page is: address to listen at, and more hosts that it answers to."""

    address: tuple[str, int]
    names: list[str]


def _require_names(names: list[str]) -> list[str]:
    from quarc_ref.viewing.doorkeeper import is_host_name

    for name in names:
        if not is_host_name(name):
            message = f"--allow-host takes the name of a host, without scheme or port: {name}"
            raise UsageError(message)
    return names


@contextmanager
def _open_page(
    source: "Source", title: str, place: _Place, *, playing: bool
) -> "Iterator[tuple[Page, Callable[[int, Event], None]]]":
    """Open a page for a stream; yield it, and what plays the stream there."""
    from quarc_ref.decoder import dequantize
    from quarc_ref.streams import decode
    from quarc_ref.viewing.outline import outline_stream
    from quarc_ref.viewing.show import Show, open_page

    scene = next(decode(source), None)
    if scene is None:
        message = "the stream has no frame"
        raise UsageError(message)
    first = dequantize(scene)
    outline = outline_stream(source)
    with open_page(outline, first, title, *place) as page:
        yield page, partial(Show(source, outline, page, playing=playing).run, first)


def _announce(title: str, url: str, *, as_json: bool, open_browser: bool) -> None:
    if as_json:
        print_json("view/1", {"stream": title, "url": url})
    else:
        print_table(title, {"page": url, "end": "Ctrl-C"})
    sys.stdout.flush()
    warn_of_reference_engine()
    if open_browser:
        webbrowser.open(url)
