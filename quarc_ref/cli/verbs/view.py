"""The `view` command: plays a stream in a browser."""

import socket
import sys
import webbrowser
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from quarc_ref.cli.errors import UsageError, report_errors
from quarc_ref.cli.following import (
    DEFAULT_PATIENCE,
    FollowedStreamName,
    FollowFlag,
    Patience,
    make_follow_options,
)
from quarc_ref.cli.options import STANDARD_STREAM, AsJson, UpAxis, format_stream_name
from quarc_ref.cli.output import print_fields, print_json, print_message
from quarc_ref.cli.page_options import (
    AudioFile,
    AudioStart,
    CameraName,
    Title,
    choose_initial_camera,
    make_page_title,
    read_page_audio,
)
from quarc_ref.cli.seekable_stream import growing_copy, open_seekable

if TYPE_CHECKING:
    from quarc_ref.streams import Follow, Source
    from quarc_ref.viewing.page import PageOptions
    from quarc_ref.viewing.server import Server

_WILDCARD_ADDRESSES = ("0.0.0.0", "::")


def view(
    file: FollowedStreamName,
    host: Annotated[
        str,
        typer.Option(
            "--host", help="Address to listen on; 0.0.0.0 accepts connections from other machines."
        ),
    ] = "127.0.0.1",
    port: Annotated[
        int, typer.Option("--port", min=1, max=65535, help="First port to try.")
    ] = 8080,
    allowed_hosts: Annotated[
        list[str] | None,
        typer.Option(
            "--allow-host",
            metavar="NAME",
            help="Also accept requests for another host name, such as the name of a reverse proxy "
            "or tunnel; may be repeated.",
            show_default=False,
        ),
    ] = None,
    open_browser: Annotated[
        bool, typer.Option("--open/--no-open", help="Open the page in a browser.")
    ] = True,
    title: Title = None,
    camera: CameraName = None,
    up: UpAxis = None,
    autoplay: Annotated[
        bool, typer.Option("--autoplay/--no-autoplay", help="Start playing when the page opens.")
    ] = True,
    loop: Annotated[bool, typer.Option("--loop/--no-loop", help="Play in a loop.")] = True,
    audio: AudioFile = None,
    audio_start: AudioStart = None,
    follow: FollowFlag = False,
    patience: Patience = DEFAULT_PATIENCE,
    as_json: AsJson = False,
) -> None:
    """Play a stream in a browser, which decodes and renders it. Ctrl-C stops the server.

    The URL contains a random token, so that only people who know the URL can open the page. With
    --follow or from standard input, the stream plays while it is received.
    """
    follow_options = make_follow_options(file, patience, follow=follow)
    with report_errors():
        from quarc_ref.viewing.page import PageOptions

        host_names = _require_host_names(allowed_hosts or [])
        sound = read_page_audio(audio, audio_start)
        page_title = title or make_page_title(file)
        options = PageOptions(page_title, camera, up, autoplay, loop, audio=sound)
        with (
            _report_stop(),
            _open_stream(file, options, follow_options) as stream,
            _open_server(stream, (host, port), host_names) as server,
        ):
            _print_url(format_stream_name(file), server, host, as_json=as_json)
            if open_browser:
                webbrowser.open(server.url)
            server.serve_forever(poll_interval=0.1)


@contextmanager
def _report_stop() -> Iterator[None]:
    """If the block is interrupted, say that the server has stopped: this is its normal end."""
    try:
        yield
    except KeyboardInterrupt as error:
        message = "stopped"
        raise KeyboardInterrupt(message) from error


class _ViewedStream(NamedTuple):
    """An open stream, and the options of its page."""

    source: "Source"
    options: "PageOptions"


@contextmanager
def _open_stream(
    name: str, options: "PageOptions", follow: "Follow | None"
) -> Iterator[_ViewedStream]:
    """Open a stream, and check that its first camera or the requested camera exists."""
    from quarc_ref.streams import open_source
    from quarc_ref.streams.follow import poll
    from quarc_ref.viewing.outline import read_cameras

    is_standard_input = name == STANDARD_STREAM
    with ExitStack() as stack:
        source = stack.enter_context(open_source(name, follow))
        if not is_standard_input:
            source = stack.enter_context(open_seekable(source))
        cameras = poll(lambda: read_cameras(source), follow)
        choose_initial_camera(cameras, options.camera)
        if is_standard_input:
            source = stack.enter_context(growing_copy(source))
        is_live = is_standard_input or follow is not None
        if not is_live:
            _warn_if_incomplete(name, source)
        yield _ViewedStream(source, replace(options, live=is_live))


def _warn_if_incomplete(name: str, source: "Source") -> None:
    from quarc_ref.streams.seek import read_tail_chunk

    if read_tail_chunk(source, source.size() or 0) is None:
        print_message(
            f"{format_stream_name(name)} is incomplete (no TAIL chunk); use --follow to play a "
            "stream while it is written"
        )


def _open_server(
    stream: _ViewedStream, address: tuple[str, int], host_names: list[str]
) -> "Server":
    from quarc_ref.streams import BytesSource
    from quarc_ref.viewing.page import PLAYER_FILE, STREAM_FILE, build_page, read_player
    from quarc_ref.viewing.server import Resource, Server
    from quarc_ref.viewing.shared_source import GrowingSource, SharedSource

    source_class = GrowingSource if stream.options.live else SharedSource
    resources = {
        "": Resource("text/html; charset=utf-8", BytesSource(build_page(stream.options))),
        PLAYER_FILE: Resource("text/javascript; charset=utf-8", BytesSource(read_player())),
        STREAM_FILE: Resource("application/octet-stream", source_class(stream.source)),
    }
    audio = stream.options.audio
    if audio is not None:
        resources[audio.name] = Resource(audio.media_type, BytesSource(audio.data))
    if address[0] in _WILDCARD_ADDRESSES:
        host_names = [*host_names, socket.gethostname()]
    return Server(address, resources, host_names, print_message)


def _require_host_names(names: list[str]) -> list[str]:
    from quarc_ref.viewing.request_filter import is_host_name

    for name in names:
        if not is_host_name(name):
            message = f"--allow-host takes a host name without scheme or port, not {name}"
            raise UsageError(message)
    return names


def _print_url(title: str, server: "Server", host: str, *, as_json: bool) -> None:
    if as_json:
        print_json("view/1", {"stream": title, "url": server.url})
    else:
        rows = {"page": server.url}
        if host in _WILDCARD_ADDRESSES:
            rows["from other machines"] = server.build_url(socket.gethostname())
        print_fields(title, rows | {"stop with": "Ctrl-C"})
    sys.stdout.flush()
