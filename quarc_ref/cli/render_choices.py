"""Chooses the camera, picture size and video format of `render`."""

from fractions import Fraction
from typing import TYPE_CHECKING, Literal

from quarc_ref.cli.errors import UsageError

if TYPE_CHECKING:
    from quarc_ref.datasets.video_writer import VideoFormat
    from quarc_ref.format.cameras import Camera
    from quarc_ref.viewing.outline import Outline

_MAX_RATE_TERM = (1 << 31) - 1  # FFmpeg's rationals have 32-bit terms
# The quality is nearly lossless, so that smaller files can be encoded from the video.
_X264 = {"crf": "6", "preset": "medium"}
# For lookahead, x264 buffers dozens of pictures with ten bytes per pixel. For large pictures, this
# needs too much memory.
_LARGE = 1 << 21
_X264_LARGE = _X264 | {
    "x264-params": "rc-lookahead=0:sync-lookahead=0:mbtree=0:ref=1:bframes=0:sliced-threads=1"
}


_VP9 = {"crf": "12", "b": "0", "deadline": "good", "cpu-used": "4", "row-mt": "1"}
_OPTIONS = {
    ("mp4", False): _X264,
    ("mp4", True): _X264_LARGE,
    ("webm", False): _VP9,
    ("webm", True): _VP9 | {"lag-in-frames": "0"},
}


def choose_camera(outline: "Outline", name: str | None, width: int | None, kind: str) -> "Camera":
    """Return the requested camera, resized to pictures of the requested width.

    Raises:
        UsageError: The stream has no camera of the name, or its pictures are too large.
    """
    from quarc_ref.datasets.calibration import require_picture_size, require_video_size
    from quarc_ref.viewing.outline import find_camera, fit_height, resize_camera

    require = require_video_size if kind in ("mp4", "webm") else require_picture_size
    try:
        camera = find_camera(outline.cameras, name)
        wanted = width or camera.width
        require(wanted, fit_height(camera, wanted))
    except ValueError as error:
        raise UsageError(str(error)) from error
    return resize_camera(camera, width) if width else camera


def require_pixels(camera: "Camera", most: int) -> None:
    """Raise UsageError if pictures have too many pixels; the message names options to change."""
    pixels = camera.width * camera.height
    if pixels > most:
        message = (
            f"pictures of {camera.width} x {camera.height} have {pixels:,} pixels, more than "
            f"the limit of {most:,}: choose a smaller --width, or --max-pixels {pixels}"
        )
        raise UsageError(message)


def choose_form(
    outline: "Outline", camera: "Camera", pixels: str, container: Literal["mp4", "webm"]
) -> "VideoFormat":
    """Choose the video format for a camera's pictures, at the stream's frame rate.

    Raises:
        UsageError: The pixel format does not support the picture size, or FFmpeg cannot represent
            the frame rate.
    """
    from quarc_ref.datasets.video_writer import VideoFormat

    if pixels == "yuv420p" and (camera.width % 2 or camera.height % 2):
        message = (
            f"pictures of {camera.width} x {camera.height} cannot be yuv420p, which needs even "
            "sizes: choose another --width, or yuv444p"
        )
        raise UsageError(message)
    pace = Fraction(outline.header.timescale, outline.header.frame_ticks)
    if max(pace.as_integer_ratio()) > _MAX_RATE_TERM:
        message = f"a video cannot have {pace} frames per second: choose --to png"
        raise UsageError(message)
    is_large = camera.width * camera.height > _LARGE
    options = _OPTIONS[container, is_large]
    return VideoFormat(camera.width, camera.height, pace, options, pixels, container)
