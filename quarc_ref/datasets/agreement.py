"""Whether the videos of a capture go together frame by frame: frame rates and lengths."""

import math
from collections.abc import Callable, Sequence
from statistics import median_high

import numpy as np

from quarc_ref.datasets.errors import FrameRateError
from quarc_ref.datasets.video import VideoReader

_RATE_TOLERANCE = 1e-3  # 29.97 and 30 differ by as much, and are taken for one
_TIME_TOLERANCE = 0.25  # of a frame's duration; a frame that was left out is off by half of one
_MOST_NAMED = 5


def require_one_rate(videos: Sequence[VideoReader]) -> None:
    """Prove that the n-th frames of all videos are of one moment, if the first ones are.

    Args:
        videos: At least one.

    Raises:
        FrameRateError: A video has a variable frame rate, or another one than most have.
    """
    for video in videos:
        _require_constant_rate(video)
    usual = median_high(video.frames_per_second for video in videos)
    odd = [
        video
        for video in videos
        if not math.isclose(video.frames_per_second, usual, rel_tol=_RATE_TOLERANCE)
    ]
    if odd:
        message = (
            f"{_list_videos(odd, _tell_rate)}, the others have {usual:g}: convert all to one "
            "frame rate"
        )
        raise FrameRateError(message)


def compare_lengths(videos: Sequence[VideoReader]) -> str | None:
    """Return what is wrong with the lengths of the videos; None if all have as many frames.

    Args:
        videos: At least one.
    """
    usual = median_high(video.frame_count for video in videos)
    odd = [video for video in videos if video.frame_count != usual]
    if not odd:
        return None
    least = min(video.frame_count for video in videos)
    return (
        f"{_list_videos(odd, _tell_length)}, the others have {usual}: cut all to one length, or "
        f"take no more than the {least} that all have (encode --frames {least})"
    )


def _require_constant_rate(video: VideoReader) -> None:
    times = video.frame_times
    if len(times) < 3:
        return
    duration = (times[-1] - times[0]) / (len(times) - 1)
    strays = np.abs(times - np.linspace(times[0], times[-1], len(times)))
    if strays.max() > _TIME_TOLERANCE * duration + video.tick:
        shortest, *_, longest = sorted(np.diff(times) * 1000)
        message = (
            f"{video.path} has a variable frame rate: its frames last from {shortest:.1f} to "
            f"{longest:.1f} ms, {1 / duration:.2f} of them a second on average; convert it "
            f"(ffmpeg -i {video.path.name} -vf fps={max(1, round(1 / duration))} NEW.mp4)"
        )
        raise FrameRateError(message)


def _list_videos(videos: Sequence[VideoReader], tell: Callable[[VideoReader], str]) -> str:
    named = ", ".join(f"{video.path.name} has {tell(video)}" for video in videos[:_MOST_NAMED])
    more = len(videos) - _MOST_NAMED
    return f"{named} and {more} more differ" if more > 0 else named


def _tell_rate(video: VideoReader) -> str:
    return f"{video.frames_per_second:g} frames per second"


def _tell_length(video: VideoReader) -> str:
    return f"{video.frame_count} frames"
