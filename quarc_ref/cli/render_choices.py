"""Chooses the camera, picture size, background and video format of `render`."""

import re
from fractions import Fraction
from typing import TYPE_CHECKING, Literal

from quarc_ref.cli.errors import UsageError

if TYPE_CHECKING:
    from quarc_ref.cli.render_output import OutputKind
    from quarc_ref.datasets.video_writer import VideoFormat
    from quarc_ref.format.cameras import Camera
    from quarc_ref.viewing.draw_frames import Color
    from quarc_ref.viewing.outline import Outline

_NAMED_COLORS = {"black": "#000000", "white": "#ffffff"}
_COLOR_CODE = re.compile(r"#[0-9a-fA-F]{6}")
_MAX_DENOMINATOR = 1001  # as in 30000/1001 frames per second
_MAX_RATIONAL_TERM = (1 << 31) - 1  # FFmpeg's rationals have 32-bit terms
# The quality is nearly lossless, so that smaller files can be encoded from the video.
_X264_OPTIONS = {"crf": "6", "preset": "medium"}
# For lookahead, x264 buffers dozens of pictures at ten bytes per pixel. For large pictures, this
# needs too much memory.
_LARGE_PICTURE_PIXELS = 1 << 21
_X264_LARGE_OPTIONS = _X264_OPTIONS | {
    "x264-params": "rc-lookahead=0:sync-lookahead=0:mbtree=0:ref=1:bframes=0:sliced-threads=1"
}


_VP9_OPTIONS = {"crf": "12", "b": "0", "deadline": "good", "cpu-used": "4", "row-mt": "1"}
_ENCODER_OPTIONS = {
    ("mp4", False): _X264_OPTIONS,
    ("mp4", True): _X264_LARGE_OPTIONS,
    ("webm", False): _VP9_OPTIONS,
    ("webm", True): _VP9_OPTIONS | {"lag-in-frames": "0"},
}


def parse_background(text: str | None) -> "Color | None":
    """Return the color of a background, 0 to 1 (default: black); None if it is transparent.

    Raises:
        UsageError: The text is no color.
    """
    if text == "transparent":
        return None
    if text is None:
        text = "black"
    code = _NAMED_COLORS.get(text, text)
    if not _COLOR_CODE.fullmatch(code):
        message = f"--background is {text!r}, not black, white, transparent or a color like #ff8000"
        raise UsageError(message)
    red, green, blue = (byte / 255 for byte in bytes.fromhex(code[1:]))
    return red, green, blue


def reject_conflicts(
    kind: "OutputKind", depth: bool, pixel_format: str | None, background: str | None
) -> None:
    """Raise UsageError if options cannot be combined."""
    is_video = kind in ("mp4", "webm")
    conflicts = {
        "--pixels is for videos, not for PNG files": not is_video and pixel_format,
        "--to npz needs --depth": kind == "npz" and not depth,
        f"--depth cannot be combined with --to {kind}": depth and is_video,
        "--depth cannot be combined with --background": depth and background,
        "videos cannot be transparent: choose another --background, or --to png": (
            is_video and background == "transparent"
        ),
    }
    for message, is_conflict in conflicts.items():
        if is_conflict:
            raise UsageError(message)


def choose_camera(
    outline: "Outline", name: str | None, width: int | None, output_kind: str
) -> "Camera":
    """Return the requested camera, resized to pictures of the requested width.

    Raises:
        UsageError: The stream has no camera with this name, or the picture size is not supported.
    """
    from quarc_ref.datasets.calibration import require_picture_size, require_video_size
    from quarc_ref.viewing.outline import compute_scaled_height, find_camera, resize_camera

    require_size = require_video_size if output_kind in ("mp4", "webm") else require_picture_size
    try:
        camera = find_camera(outline.cameras, name)
        requested_width = width or camera.width
        require_size(requested_width, compute_scaled_height(camera, requested_width))
    except ValueError as error:
        raise UsageError(str(error)) from error
    return resize_camera(camera, width) if width else camera


def require_pixel_limit(camera: "Camera", max_pixels: int) -> None:
    """Raise UsageError if pictures have too many pixels; the message suggests options."""
    pixels = camera.width * camera.height
    if pixels > max_pixels:
        message = (
            f"pictures of {camera.width} x {camera.height} have {pixels:,} pixels, more than "
            f"the limit of {max_pixels:,}: choose a smaller --width, or --max-pixels {pixels}"
        )
        raise UsageError(message)


def choose_video_format(
    outline: "Outline",
    camera: "Camera",
    pixel_format: str | None,
    container: Literal["mp4", "webm"],
    frames_per_second: float | None = None,
) -> "VideoFormat":
    """Choose the video format for a camera's pictures, by default at the stream's frame rate.

    Without a pixel format, yuv420p is chosen if the picture size allows it.

    Raises:
        UsageError: The pixel format does not support the picture size, or FFmpeg cannot represent
            the frame rate.
    """
    from quarc_ref.datasets.video_writer import VideoFormat

    is_even = camera.width % 2 == 0 and camera.height % 2 == 0
    pixel_format = pixel_format or ("yuv420p" if is_even else "yuv444p")
    if pixel_format == "yuv420p" and not is_even:
        message = (
            f"pictures of {camera.width} x {camera.height} cannot be yuv420p, which needs an even "
            "width and height: choose another --width, or --pixels yuv444p"
        )
        raise UsageError(message)
    frame_rate = Fraction(outline.header.timescale, outline.header.frame_ticks)
    if frames_per_second is not None:
        frame_rate = Fraction(frames_per_second).limit_denominator(_MAX_DENOMINATOR)
    if max(frame_rate.as_integer_ratio()) > _MAX_RATIONAL_TERM:
        message = f"a video cannot have {frame_rate} frames per second: choose --to png"
        raise UsageError(message)
    is_large = camera.width * camera.height > _LARGE_PICTURE_PIXELS
    options = _ENCODER_OPTIONS[container, is_large]
    return VideoFormat(camera.width, camera.height, frame_rate, options, pixel_format, container)
