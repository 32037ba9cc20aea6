"""Pictures to an H.264 video that decodes to the same colors, and to PNG and JPEG files.

BT.601 at limited range is what FFmpeg's scaler takes a video for that does not
say; it is written down all the same.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import BinaryIO

import av
from av.video.reformatter import ColorRange, Colorspace, Interpolation
from av.video.stream import VideoStream

from quarc_ref.datasets.capture import Image

_BT709_PRIMARIES = 1  # which are sRGB's
_SRGB_TRANSFER = 13
_JPEG_QUANTIZER = 3  # from 2, the best, to 31


@dataclass(frozen=True, slots=True)
class VideoForm:
    """What a video is to be.

    Attributes:
        width: Pixels.
        height: Pixels.
        frames_per_second: Its pace.
        x264: Options of the encoder.
        pixel_format: `yuv444p`, or `yuv420p`, which needs even sizes and
            halves the resolution of colors.
    """

    width: int
    height: int
    frames_per_second: Fraction
    x264: Mapping[str, str] = field(default_factory=dict)
    pixel_format: str = "yuv444p"


def write_mp4(sink: BinaryIO, pictures: Iterable[Image], form: VideoForm) -> int:
    """Write pictures as an mp4 file.

    Args:
        sink: Of the file; must seek.
        pictures: `[H, W, 3]` sRGB each.
        form: Of the video.

    Returns:
        How many there were.

    Raises:
        OSError: FFmpeg has no H.264 encoder, or cannot write there.
    """
    count = 0
    try:
        with av.open(sink, "w", format="mp4", options={"fflags": "+bitexact"}) as container:
            stream = container.add_stream(
                "libx264", form.frames_per_second, options=dict(form.x264)
            )
            _describe(stream, form)
            for picture in pictures:
                container.mux(stream.encode(_to_frame(picture, count, form)))
                count += 1
            container.mux(stream.encode(None))
    except av.FFmpegError as error:
        message = f"the video cannot be written as H.264: {error}"
        raise OSError(message) from error
    return count


def build_png(picture: Image) -> bytes:
    """Return the bytes of a PNG file of a picture `[H, W, 3]` sRGB."""
    frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
    return _encode_still(av.CodecContext.create("png", "w"), frame)


def build_jpeg(picture: Image) -> bytes:
    """Return the bytes of a JPEG file of a picture `[H, W, 3]` sRGB, of good quality."""
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


def _describe(stream: VideoStream, form: VideoForm) -> None:
    stream.width, stream.height, stream.pix_fmt = form.width, form.height, form.pixel_format
    context = stream.codec_context
    context.color_range = ColorRange.MPEG
    context.colorspace = Colorspace.ITU601
    context.color_primaries = _BT709_PRIMARIES
    context.color_trc = _SRGB_TRANSFER


def _to_frame(picture: Image, index: int, form: VideoForm) -> av.VideoFrame:
    frame = av.VideoFrame.from_ndarray(picture, format="rgb24").reformat(
        format=form.pixel_format,
        dst_colorspace=Colorspace.ITU601,
        dst_color_range=ColorRange.MPEG,
        interpolation=Interpolation.AREA,  # the mean of four pixels is what decoding repeats
    )
    frame.pts, frame.time_base = index, 1 / form.frames_per_second
    return frame
