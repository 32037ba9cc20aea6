"""Options that `view` and `publish` share: title and camera of the page."""

from typing import TYPE_CHECKING, Annotated

import typer

from quarc_ref.cli.errors import UsageError
from quarc_ref.cli.options import format_stream_name

if TYPE_CHECKING:
    from quarc_ref.format.cameras import Camera

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
