"""Writes the video of a synthetic camera; the same pictures give the same bytes.

x264 runs on one thread and without assembly code. With assembly code, roughly one in several
hundred runs produces different bytes.
"""

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

from quarc_ref.datasets.capture import Image
from quarc_ref.datasets.video_writer import VideoFormat, write_video_file
from quarc_ref.files import atomic_file
from quarc_ref.synth.options import SynthOptions

_X264_OPTIONS = {"crf": "10", "preset": "medium", "threads": "1", "x264-params": "asm=0"}


def write_video(path: Path, pictures: Iterable[Image], options: SynthOptions) -> None:
    """Write pictures as an mp4 file.

    Args:
        path: Path of the file; an existing file is replaced.
        pictures: `[H, W, 3]` pictures in sRGB, 8 bits.
        options: Options that give the size and the frame rate.

    Raises:
        OSError: FFmpeg has no H.264 encoder, or the file cannot be written.
    """
    video_format = VideoFormat(
        options.width, options.height, Fraction(options.frames_per_second), _X264_OPTIONS
    )
    with atomic_file(path) as sink:
        write_video_file(sink, pictures, video_format)
