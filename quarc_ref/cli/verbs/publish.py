"""The `publish` command: writes a page that plays a stream, as a folder or as one HTML file."""

import os
import shlex
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated
from urllib.parse import quote, urlsplit

import typer

from quarc_ref.cli.errors import UsageError, report_errors
from quarc_ref.cli.options import AsJson, Force, StreamName, UpAxis
from quarc_ref.cli.output import escape_controls, print_fields, print_json, print_message
from quarc_ref.cli.page_options import (
    AudioFile,
    AudioStart,
    CameraName,
    Title,
    choose_initial_camera,
    make_page_title,
    read_page_audio,
)
from quarc_ref.cli.targets import open_output_file, written_folder
from quarc_ref.wording import format_count, suggest_install

if TYPE_CHECKING:
    from collections.abc import Callable

    from quarc_ref.format.cameras import Camera
    from quarc_ref.streams import Source
    from quarc_ref.viewing.page import PageOptions
    from quarc_ref.viewing.site import Site

_PAGE_SUFFIXES = (".html", ".htm")
_IFRAME_WIDTH = 960
_IFRAME_HEIGHT = 600  # pixels, for streams without cameras
_CONTROLS_HEIGHT = 93  # pixels: height of the player's controls on a page of width _IFRAME_WIDTH


def publish(
    file: StreamName,
    output_name: Annotated[
        str,
        typer.Option(
            "--output",
            "-o",
            metavar="FOLDER|PAGE.html",
            help="Folder to create, or one page that contains everything.",
        ),
    ],
    title: Title = None,
    camera: CameraName = None,
    up: UpAxis = None,
    autoplay: Annotated[
        bool, typer.Option("--autoplay", help="Start playing when the page opens.")
    ] = False,
    loop: Annotated[bool, typer.Option("--loop", help="Play in a loop.")] = False,
    audio: AudioFile = None,
    audio_start: AudioStart = None,
    url: Annotated[
        str | None,
        typer.Option(
            "--url",
            metavar="URL",
            help="URL at which the folder or page will be served, for the iframe and for the link "
            "previews of a folder.",
            show_default=False,
        ),
    ] = None,
    as_json: AsJson = False,
    force: Force = False,
) -> None:
    """Create a page that plays a stream.

    A folder is for any web server. A single HTML page contains the player and the stream, so it can
    be sent by mail and opened from disk; it is a third larger than the stream, and plays when it is
    completely loaded. The command prints an iframe for embedding the page in other pages. If the
    extra "media" is installed, the page has a poster, which is a picture of the first frame.
    """
    with report_errors():
        from quarc_ref.streams import open_source
        from quarc_ref.viewing.outline import read_cameras
        from quarc_ref.viewing.page import PageOptions, build_iframe

        output = Path(output_name)
        is_folder = output_name.endswith(("/", os.sep))  # a path has no trailing slash
        is_single = output.suffix.lower() in _PAGE_SUFFIXES and not is_folder
        if url:
            page_url = _normalize_url(url, is_single=is_single)
        else:
            page_url = _make_local_url(output, is_single=is_single)
        sound = read_page_audio(audio, audio_start)
        page_title = title or make_page_title(file)
        options = PageOptions(page_title, camera, up, autoplay, loop, audio=sound)
        with open_source(file) as source:
            poster_camera = choose_initial_camera(read_cameras(source), camera)

            def draw(copy: "Source") -> bytes | None:
                return _draw_poster(copy, poster_camera)

            if is_single:
                site = _write_single_page(output, source, options, draw, force=force)
            else:
                site = _write_folder(output, source, options, draw, url and page_url, force=force)
        iframe = build_iframe(options.title, page_url, *_choose_iframe_size(poster_camera))
        _print_result(output, site, iframe, is_single=is_single, as_json=as_json)


def _write_folder(
    output: Path,
    source: "Source",
    options: "PageOptions",
    draw_poster: "Callable[[Source], bytes | None]",
    url: str | None,
    *,
    force: bool,
) -> "Site":
    from quarc_ref.viewing.site import write_site

    with written_folder(output, force=force) as folder:
        return write_site(folder, source, options, draw_poster, url)


def _write_single_page(
    output: Path,
    source: "Source",
    options: "PageOptions",
    draw_poster: "Callable[[Source], bytes | None]",
    *,
    force: bool,
) -> "Site":
    from quarc_ref.viewing.site import SinglePageError, write_single_page

    try:
        with open_output_file(output, force=force) as sink:
            return write_single_page(sink, source, options, draw_poster)
    except SinglePageError as error:
        raise UsageError(str(error)) from error


def _make_local_url(output: Path, *, is_single: bool) -> str:
    """Return the URL of a page relative to the folder that contains it."""
    name = quote(os.fsencode(output.name))
    return name if is_single else f"{name}/"


def _normalize_url(url: str, *, is_single: bool) -> str:
    """Return the URL of a page; that of a folder gets a trailing slash if it is missing.

    Raises:
        UsageError: The URL is not on an http or https server.
    """
    if not _is_page_url(url):
        example = "page.html" if is_single else "site/"
        message = (
            f"--url takes the URL of the {'page' if is_single else 'folder'}, such as "
            f"https://example.org/{example}, not {url}"
        )
        raise UsageError(message)
    return url if is_single else f"{url.rstrip('/')}/"


def _is_page_url(url: str) -> bool:
    try:
        parts = urlsplit(url)
    except ValueError:
        return False
    is_on_server = parts.scheme in ("http", "https") and bool(parts.hostname)
    return is_on_server and not (parts.query or parts.fragment)


def _draw_poster(source: "Source", camera: "Camera | None") -> bytes | None:
    """Render the poster as JPEG; print a message and return None if that is not possible."""
    if camera is None:
        print_message("the page has no poster, because the stream has no cameras")
        return None
    try:
        from quarc_ref.viewing.poster import draw_poster
    except ImportError as error:
        print_message(
            f"the page has no poster: {error.name} cannot be imported; {suggest_install('media')}"
        )
        return None
    return draw_poster(source, camera)


def _choose_iframe_size(camera: "Camera | None") -> tuple[int, int]:
    """Return the size in pixels of an iframe that fits a camera's picture and the controls."""
    from quarc_ref.viewing.outline import compute_scaled_height

    height = _IFRAME_HEIGHT if camera is None else compute_scaled_height(camera, _IFRAME_WIDTH)
    return _IFRAME_WIDTH, min(height, _IFRAME_WIDTH) + _CONTROLS_HEIGHT


def _print_result(
    output: Path, site: "Site", iframe: str, *, is_single: bool, as_json: bool
) -> None:
    if as_json:
        document: dict[str, object] = {
            "folder": None if is_single else str(output),
            "page": str(output if is_single else output / "index.html"),
            "files": [output.name] if is_single else site.file_names,
            "frames": site.frame_count,
            "bytes": site.stream_bytes,
            "poster": site.poster_name,
            "audio": site.audio_name,
            "iframe": iframe,
        }
        print_json("publish/3", document)
        return
    rows = {"stream": f"{format_count(site.frame_count, 'frame')}, {site.stream_bytes:,} bytes"}
    if is_single:
        rows["page"] = f"{output.stat().st_size:,} bytes"
        rows["to try it"] = "open it in a browser"
    else:
        rows["poster"] = site.poster_name or "none"
        rows["audio"] = site.audio_name or "none"
        rows["to try it"] = _format_server_command(output)
    print_fields(str(output), rows)
    sys.stdout.write(f"\n{escape_controls(iframe)}\n")  # one line, so that it can be copied


def _format_server_command(folder: Path) -> str:
    """Return a command line that serves a folder, for the shell of this system."""
    options = ["-m", "http.server", "--directory", str(folder)]
    if sys.platform == "win32":  # where python3 opens the store instead
        return subprocess.list2cmdline(["python", *options])
    return shlex.join(["python3", *options])
