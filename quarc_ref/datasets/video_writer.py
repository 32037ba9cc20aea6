"""Writes pictures as H.264 or VP9 videos with exact color metadata, and as PNG and JPEG files.

Videos use BT.601 with limited range, which FFmpeg's scaler also assumes for videos without color
metadata.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import BinaryIO, Literal, cast

import av
import numpy as np
from av.video.reformatter import ColorRange, Colorspace, Interpolation
from av.video.stream import VideoStream
from numpy.typing import NDArray

from quarc_ref.datasets.capture import Image

_BT709_PRIMARIES = 1  # same primaries as sRGB
_SRGB_TRANSFER = 13
_ENCODERS = {"mp4": "libx264", "webm": "libvpx-vp9"}
_CODECS = {"mp4": "H.264", "webm": "VP9"}
_JPEG_QUANTIZER = 3  # FFmpeg's JPEG quality, from 2 (best) to 31


@dataclass(frozen=True, slots=True)
class VideoFormat:
    """Format of a video.

    Attributes:
        width: Picture width, pixels.
        height: Picture height, pixels.
        frames_per_second: Frame rate.
        options: Options of FFmpeg's encoder.
        pixel_format: `yuv444p`, or `yuv420p`, which requires an even width and height and halves
            the resolution of chroma.
        container: `mp4` for H.264, `webm` for VP9.
    """

    width: int
    height: int
    frames_per_second: Fraction
    options: Mapping[str, str] = field(default_factory=dict)
    pixel_format: str = "yuv444p"
    container: Literal["mp4", "webm"] = "mp4"


def write_video_file(sink: BinaryIO, pictures: Iterable[Image], video_format: VideoFormat) -> int:
    """Write pictures as a video file.

    Args:
        sink: Seekable binary file to write to.
        pictures: Pictures, each `[H, W, 3]` sRGB.
        video_format: Format of the video.

    Returns:
        Number of frames written.

    Raises:
        OSError: FFmpeg lacks the encoder, or the file cannot be written.
    """
    count = 0
    try:
        container_options = {"fflags": "+bitexact"}
        with av.open(
            sink, "w", format=video_format.container, options=container_options
        ) as container:
            stream = cast(
                "VideoStream",
                container.add_stream(
                    _ENCODERS[video_format.container],
                    video_format.frames_per_second,
                    options=dict(video_format.options),
                ),
            )
            _set_format(stream, video_format)
            for picture in pictures:
                container.mux(stream.encode(_convert_to_frame(picture, count, video_format)))
                count += 1
            container.mux(stream.encode(None))
    except av.FFmpegError as error:
        if isinstance(error, av.PyAVCallbackError) and isinstance(error.__context__, OSError):
            raise error.__context__ from None  # `sink` raised it; closing hid it
        message = f"the video cannot be written as {_CODECS[video_format.container]}: {error}"
        raise OSError(message) from error
    return count


def build_png(picture: Image) -> bytes:
    """Encode an sRGB picture `[H, W, 3]`, or `[H, W, 4]` with alpha, as PNG."""
    frame = av.VideoFrame.from_ndarray(picture, format="rgb24" if picture.shape[2] == 3 else "rgba")
    return _encode_still(av.CodecContext.create("png", "w"), frame)


def build_depth_png(levels: NDArray[np.uint16]) -> bytes:
    """Encode `[H, W]` 16-bit gray levels as PNG."""
    frame = av.VideoFrame.from_ndarray(levels, format="gray16le").reformat(format="gray16be")
    return _encode_still(av.CodecContext.create("png", "w"), frame)


def build_jpeg(picture: Image) -> bytes:
    """Encode an `[H, W, 3]` sRGB picture as JPEG with high quality."""
    frame = av.VideoFrame.from_ndarray(picture, format="rgb24").reformat(
        format="yuvj444p", dst_colorspace=Colorspace.ITU601, dst_color_range=ColorRange.JPEG
    )
    codec = av.CodecContext.create("mjpeg", "w")
    codec.qmin = codec.qmax = _JPEG_QUANTIZER
    return _encode_still(codec, frame)


def _encode_still(codec: av.VideoCodecContext, frame: av.VideoFrame) -> bytes:
    codec.width, codec.height, codec.pix_fmt = frame.width, frame.height, frame.format.name
    codec.time_base = Fraction(1)
    return b"".join(map(bytes, [*codec.encode(frame), *codec.encode(None)]))


def _set_format(stream: VideoStream, video_format: VideoFormat) -> None:
    stream.width, stream.height, stream.pix_fmt = (
        video_format.width,
        video_format.height,
        video_format.pixel_format,
    )
    context = stream.codec_context
    context.color_range = ColorRange.MPEG
    context.colorspace = Colorspace.ITU601
    context.color_primaries = _BT709_PRIMARIES
    context.color_trc = _SRGB_TRANSFER


def _convert_to_frame(picture: Image, index: int, video_format: VideoFormat) -> av.VideoFrame:
    frame = av.VideoFrame.from_ndarray(picture, format="rgb24").reformat(
        format=video_format.pixel_format,
        dst_colorspace=Colorspace.ITU601,
        dst_color_range=ColorRange.MPEG,
        interpolation=Interpolation.AREA,  # chroma is the mean of four pixels, as decoders assume
    )
    frame.pts, frame.time_base = index, 1 / video_format.frames_per_second
    return frame
