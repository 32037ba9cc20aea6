"""Options that `view` and `publish` share: title, camera and audio of the page."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quarc_ref.cli.errors import UsageError
from quarc_ref.cli.options import format_stream_name

if TYPE_CHECKING:
    from quarc_ref.format.cameras import Camera
    from quarc_ref.viewing.page import PageAudio

Title = Annotated[
    str | None,
    typer.Option("--title", help="Title of the page.", show_default="name of the stream"),
]
CameraName = Annotated[
    str | None,
    typer.Option(
        "--camera",
        metavar="NAME",
        help="Camera of the stream that sets the initial view.",
        show_default="the first",
    ),
]
AudioFile = Annotated[
    Path | None,
    typer.Option(
        "--audio",
        metavar="FILE",
        help="Audio file that plays in sync with the stream, or a video with such sound.",
        show_default=False,
    ),
]
AudioStart = Annotated[
    float | None,
    typer.Option(
        "--audio-start",
        metavar="SECONDS",
        help="Time in the audio file of the frame with ordinal 0; in a video, the time after its "
        "first picture. May be negative.",
        show_default="0",
    ),
]


def read_page_audio(path: Path | None, start: float | None) -> "PageAudio | None":
    """Read the audio file of a page; return None if there is none.

    Args:
        path: Path of an audio file or a video; None for a page without audio.
        start: Time in the file of the frame with ordinal 0, seconds; None for 0.

    Raises:
        UsageError: The options conflict, or the file cannot be the audio of a page.
        CaptureError: The sound of the video cannot be read.
    """
    from quarc_ref.viewing.audio import AudioFileError, read_audio

    if start is not None and (path is None or not math.isfinite(start)):
        message = "--audio-start takes a number of seconds, and needs --audio"
        raise UsageError(message)
    if path is None:
        return None
    try:
        return read_audio(path, start or 0.0)
    except AudioFileError as error:
        raise UsageError(str(error)) from error


def make_page_title(stream_name: str) -> str:
    """Return the default page title for a stream."""
    return format_stream_name(stream_name).removesuffix(".quarc")


def choose_initial_camera(
    cameras: "tuple[Camera, ...] | None", name: str | None
) -> "Camera | None":
    """Return the camera of the initial view; None if the stream has no cameras.

    Args:
        cameras: Cameras of the stream; None if the stream has no frames.
        name: Name of a camera of the stream; None for the first camera.

    Raises:
        UsageError: The stream has no frames, or no camera with this name.
    """
    from quarc_ref.viewing.outline import CameraChoiceError, find_camera

    if cameras is None:
        message = "the stream has no frames"
        raise UsageError(message)
    if name is None and not cameras:
        return None
    try:
        return find_camera(cameras, name)
    except CameraChoiceError as error:
        raise UsageError(str(error)) from error
