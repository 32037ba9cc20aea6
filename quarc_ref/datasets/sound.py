"""Reads the sound of a video, and its start time on the same timeline as the pictures."""

from dataclasses import dataclass
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.errors import UnreadableVideoError
from quarc_ref.datasets.media import find_audio_stream, open_video


@dataclass(frozen=True, slots=True, eq=False)
class Sound:
    """Sound of a video, mixed to one channel.

    Attributes:
        samples: `[S]` samples from -1 to 1.
        start: Time stamp of the first sample in the container, seconds.
        samples_per_second: Sample rate of `samples`, hertz.
    """

    samples: NDArray[np.float32]
    start: float
    samples_per_second: int


def read_sound(path: Path, samples_per_second: int, max_seconds: float) -> Sound | None:
    """Read the sound of a video, mixed to one channel; return None if the video has no sound.

    Args:
        path: Path of the video.
        samples_per_second: Sample rate to convert to, hertz.
        max_seconds: Maximum duration to read, seconds.

    Raises:
        MissingFileError: The file does not exist.
        UnreadableVideoError: The sound cannot be decoded.
    """
    container, _ = open_video(path)
    with container:
        stream = find_audio_stream(container, path)
        if stream is None:
            return None
        resampler = av.AudioResampler(format="flt", layout="mono", rate=samples_per_second)
        blocks: list[NDArray[np.float32]] = []
        start, sample_count = 0.0, 0
        try:
            for frame in container.decode(stream):
                if not blocks and frame.pts is not None and frame.time_base is not None:
                    start = float(frame.pts * frame.time_base)
                new_blocks = [_flatten_samples(block) for block in resampler.resample(frame)]
                blocks += new_blocks
                sample_count += sum(block.size for block in new_blocks)
                if sample_count >= max_seconds * samples_per_second:
                    break
        except av.FFmpegError as error:
            message = f"the sound of {path} cannot be decoded ({error}): export the video again"
            raise UnreadableVideoError(message) from error
    if not blocks:
        return None
    return Sound(np.concatenate(blocks), start, samples_per_second)


def _flatten_samples(frame: av.AudioFrame) -> NDArray[np.float32]:
    return frame.to_ndarray().reshape(-1).astype(np.float32)
