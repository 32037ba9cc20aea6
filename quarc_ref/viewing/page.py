"""Builds the HTML page of a stream, with the player beside it or inside it.

This package contains the player that player/keep.mjs builds, so `view` and `publish` do not
need Node.
"""

import base64
import html
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from string import Template
from urllib.parse import urljoin

PLAYER_FILE = "quarc-player.js"
STREAM_FILE = "stream.quarc"
POSTER_FILE = "poster.jpg"


@dataclass(frozen=True, slots=True)
class PageAudio:
    """An audio file that plays in sync with the stream.

    Attributes:
        data: The file.
        name: Name of the file next to the page.
        media_type: Its media type, such as `audio/mp4`.
        start: Time in the file of the frame with ordinal 0, seconds; may be negative.
    """

    data: bytes
    name: str
    media_type: str
    start: float = 0.0


@dataclass(frozen=True, slots=True)
class PageOptions:
    """Options of a page; all except `title` are attributes of `<quarc-player>`.

    Attributes:
        title: Title of the page.
        camera: Name of the initial camera; None for the first camera.
        up: The axis that points up, such as `-y`; None for the up axis of the stream.
        autoplay: Whether to start playing immediately.
        loop: Whether to repeat the stream.
        live: Whether the stream is still being written.
        audio: Audio that plays in sync with the stream; None for none.
    """

    title: str
    camera: str | None = None
    up: str | None = None
    autoplay: bool = False
    loop: bool = False
    live: bool = False
    audio: PageAudio | None = None


def build_page(options: PageOptions, *, has_poster: bool = False, url: str | None = None) -> bytes:
    """Build the HTML of a page that loads stream, player and poster from its own folder.

    Args:
        options: Options of the page.
        has_poster: Whether the folder has a poster.
        url: URL of the page; None if unknown.
    """
    poster = POSTER_FILE if has_poster else None
    # Link previews need absolute URLs.
    preview = urljoin(url, POSTER_FILE) if has_poster and url is not None else None
    audio = options.audio.name if options.audio else None
    return _build_page(options, _PageUrls(PLAYER_FILE, STREAM_FILE, poster, audio, preview))


def build_single_page(options: PageOptions, stream: bytes, poster: bytes | None) -> bytes:
    """Build the HTML of a page that contains player, stream, poster and audio as data URLs.

    Browsers also open this page from a local file.

    Args:
        options: Options of the page.
        stream: The stream.
        poster: The poster as JPEG; None if there is none.
    """
    urls = _PageUrls(
        _make_data_url("text/javascript", read_player()),
        _make_data_url("application/octet-stream", stream),
        _make_data_url("image/jpeg", poster) if poster else None,
        _make_data_url(options.audio.media_type, options.audio.data) if options.audio else None,
    )
    return _build_page(options, urls)


@dataclass(frozen=True, slots=True)
class _PageUrls:
    """URLs of what a page loads; None for a poster, audio or link preview that does not exist."""

    player: str
    stream: str
    poster: str | None
    audio: str | None
    preview: str | None = None


def _build_page(options: PageOptions, urls: _PageUrls) -> bytes:
    template = resources.files(__package__).joinpath("page.html").read_text("utf-8")
    audio_start = round(options.audio.start, 3) if options.audio else 0
    player_attributes = {
        "src": urls.stream,
        "camera": options.camera,
        "up": options.up,
        "autoplay": options.autoplay,
        "loop": options.loop,
        "live": options.live,
        "audio": urls.audio,
        "audio-start": str(audio_start) if audio_start else None,
    }
    preview_metadata = {"og:type": "website", "og:title": options.title}
    if urls.preview is not None:
        preview_metadata["og:image"] = urls.preview
    page = Template(template).substitute(
        title=html.escape(options.title),
        player=urls.player,
        preview="".join(_build_meta(name, value) for name, value in preview_metadata.items()),
        attributes=_build_attributes(player_attributes),
        poster=f'<img src="{urls.poster}" alt="">' if urls.poster else "",
    )
    return page.encode(errors="replace")  # the name of a file may be no valid UTF-8


def build_iframe(title: str, url: str, width: int, height: int) -> str:
    """Build the HTML that embeds a page in another page.

    Args:
        title: Title of the page.
        url: URL of the page.
        width: Width of the iframe, pixels.
        height: Height of the iframe, pixels.
    """
    attributes = {
        "src": url,
        "title": title,
        "width": str(width),
        "height": str(height),
        "style": "border: 0; max-width: 100%",
        "allow": "autoplay; fullscreen; xr-spatial-tracking",
    }
    return f"<iframe {_build_attributes(attributes)}></iframe>"


def read_player() -> bytes:
    """Return the JavaScript module of the player."""
    return resources.files(__package__).joinpath("player", PLAYER_FILE).read_bytes()


def _make_data_url(media_type: str, data: bytes) -> str:
    return f"data:{media_type};base64,{base64.b64encode(data).decode()}"


def _build_meta(name: str, value: str) -> str:
    return f"<meta {_build_attributes({'property': name, 'content': value})}>\n"


def _build_attributes(attributes: Mapping[str, str | bool | None]) -> str:
    """Format HTML attributes; True adds a name without a value, False and None add nothing."""
    return " ".join(
        name if value is True else f'{name}="{html.escape(str(value))}"'
        for name, value in attributes.items()
        if value is not None and value is not False
    )
