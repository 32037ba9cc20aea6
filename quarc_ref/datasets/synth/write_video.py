"""Pictures to an H.264 video that decodes to the same colors, less its chroma's detail.

BT.601 at limited range is what FFmpeg's scaler takes a video for that does not
say; it is written down all the same. One thread and plain C make the bytes the
same on every run: with x264's assembly, one run in some hundreds differs.
"""

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import av
from av.video.reformatter import ColorRange, Colorspace, Interpolation
from av.video.stream import VideoStream

from quarc_ref.datasets.capture import Image
from quarc_ref.datasets.synth.options import SynthOptions

_X264 = {"crf": "10", "preset": "medium", "threads": "1", "x264-params": "asm=0"}
_BT709_PRIMARIES = 1  # which are sRGB's
_SRGB_TRANSFER = 13


def write_video(path: Path, pictures: Iterable[Image], options: SynthOptions) -> None:
    """Write pictures as an mp4 file.

    Args:
        path: Of the file.
        pictures: `[H, W, 3]` each.
        options: Size and pace.

    Raises:
        OSError: FFmpeg has no H.264 encoder, or cannot write there.
    """
    try:
        with av.open(str(path), "w", options={"fflags": "+bitexact"}) as container:
            stream = container.add_stream("libx264", options.frames_per_second, options=_X264)
            _describe(stream, options)
            for index, picture in enumerate(pictures):
                container.mux(stream.encode(_to_frame(picture, index, options)))
            container.mux(stream.encode(None))
    except av.FFmpegError as error:
        message = f"{path} cannot be written as H.264: {error}"
        raise OSError(message) from error


def _describe(stream: VideoStream, options: SynthOptions) -> None:
    stream.width, stream.height, stream.pix_fmt = options.width, options.height, "yuv444p"
    context = stream.codec_context
    context.color_range = ColorRange.MPEG
    context.colorspace = Colorspace.ITU601
    context.color_primaries = _BT709_PRIMARIES
    context.color_trc = _SRGB_TRANSFER


def _to_frame(picture: Image, index: int, options: SynthOptions) -> av.VideoFrame:
    frame = av.VideoFrame.from_ndarray(picture, format="rgb24").reformat(
        format="yuv444p",
        dst_colorspace=Colorspace.ITU601,
        dst_color_range=ColorRange.MPEG,
        interpolation=Interpolation.AREA,  # the mean of four pixels is what decoding repeats
    )
    frame.pts, frame.time_base = index, Fraction(1, options.frames_per_second)
    return frame
