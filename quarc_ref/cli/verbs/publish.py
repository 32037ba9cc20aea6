"""The `publish` command: writes a stream as a folder for any web server."""

import os
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated
from urllib.parse import quote, urlsplit

import typer

from quarc_ref.cli.errors import UsageError, report_errors
from quarc_ref.cli.options import AsJson, Force, StreamName, UpAxis
from quarc_ref.cli.output import escape_controls, print_fields, print_json, print_message
from quarc_ref.cli.page_options import CameraName, Title, choose_initial_camera, make_page_title
from quarc_ref.cli.targets import written_folder
from quarc_ref.inspection.wording import format_count

if TYPE_CHECKING:
    from quarc_ref.format.cameras import Camera
    from quarc_ref.streams import Source
    from quarc_ref.viewing.site import Site

_IFRAME_WIDTH = 960
_IFRAME_HEIGHT = 600  # pixels, for streams without cameras
_CONTROLS_HEIGHT = 93  # pixels: height of the player's controls on a page of width _IFRAME_WIDTH


def publish(
    file: StreamName,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="FOLDER", help="Folder to create."),
    ],
    title: Title = None,
    camera: CameraName = None,
    up: UpAxis = None,
    autoplay: Annotated[
        bool, typer.Option("--autoplay", help="Start playing when the page opens.")
    ] = False,
    loop: Annotated[bool, typer.Option("--loop", help="Play in a loop.")] = False,
    url: Annotated[
        str | None,
        typer.Option(
            "--url",
            metavar="URL",
            help="URL at which the folder will be served, for the iframe and for link previews.",
            show_default=False,
        ),
    ] = None,
    as_json: AsJson = False,
    force: Force = False,
) -> None:
    """Create a folder for any web server, with a page that plays a stream.

    Prints an iframe for embedding the page in other pages. If the extra "media" is installed, the
    page has a poster, which is a picture of the first frame.
    """
    with report_errors():
        from quarc_ref.streams import open_source
        from quarc_ref.viewing.outline import read_cameras
        from quarc_ref.viewing.page import PageOptions, build_iframe
        from quarc_ref.viewing.site import write_site

        page_url = _normalize_url(url) if url else f"{quote(os.fsencode(output.name))}/"
        options = PageOptions(title or make_page_title(file), camera, up, autoplay, loop)
        with open_source(file) as source, written_folder(output, force=force) as folder:
            poster_camera = choose_initial_camera(read_cameras(source), camera)
            site = write_site(
                folder,
                source,
                options,
                lambda copy: _draw_poster(copy, poster_camera),
                url and page_url,
            )
        iframe = build_iframe(options.title, page_url, *_choose_iframe_size(poster_camera))
        _print_result(output, site, iframe, as_json=as_json)


def _normalize_url(url: str) -> str:
    """Return the URL of a folder with a trailing slash, which is added if it is missing.

    Raises:
        UsageError: The URL is not that of a folder on an http or https server.
    """
    if not _is_folder_url(url):
        message = f"--url takes the URL of a folder, such as https://example.org/site/, not {url}"
        raise UsageError(message)
    return f"{url.rstrip('/')}/"


def _is_folder_url(url: str) -> bool:
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
            f"the page has no poster: {error.name} cannot be imported; install it with: pip "
            "install 'quarc-ref[media]'"
        )
        return None
    return draw_poster(source, camera)


def _choose_iframe_size(camera: "Camera | None") -> tuple[int, int]:
    """Return the size in pixels of an iframe that fits a camera's picture and the controls."""
    from quarc_ref.viewing.outline import compute_scaled_height

    height = _IFRAME_HEIGHT if camera is None else compute_scaled_height(camera, _IFRAME_WIDTH)
    return _IFRAME_WIDTH, min(height, _IFRAME_WIDTH) + _CONTROLS_HEIGHT


def _print_result(output: Path, site: "Site", iframe: str, *, as_json: bool) -> None:
    if as_json:
        document = {
            "folder": str(output),
            "files": site.file_names,
            "frames": site.frame_count,
            "bytes": site.stream_bytes,
            "poster": site.poster_name,
            "iframe": iframe,
        }
        print_json("publish/1", document)
        return
    rows = {
        "stream": f"{format_count(site.frame_count, 'frame')}, {site.stream_bytes:,} bytes",
        "poster": site.poster_name or "none",
        "to try it": f"python3 -m http.server --directory {shlex.quote(str(output))}",
    }
    print_fields(str(output), rows)
    sys.stdout.write(f"\n{escape_controls(iframe)}\n")  # one line, so that it can be copied
