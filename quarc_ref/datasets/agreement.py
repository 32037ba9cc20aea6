"""Checks the frame rate and colors of a capture, and that its videos agree.

They should have the same frame rate, length and rotation flag.
"""

import math
from collections import Counter
from collections.abc import Sequence
from itertools import compress
from statistics import median_high

import numpy as np

from quarc_ref.datasets.capture_notes import NOTES_NAME
from quarc_ref.datasets.errors import FrameRateError
from quarc_ref.datasets.findings import STATED_FRAME_RATE, UNEVEN_LENGTHS, Finding, format_names
from quarc_ref.datasets.ignored_frames import suggest_ignoring_ends
from quarc_ref.datasets.orientation import FLAG_REMEDY
from quarc_ref.datasets.video import UNSTATED_MATRIX, VideoReader
from quarc_ref.format.frame_rate import MAX_FRAME_RATE, MIN_FRAME_RATE, is_frame_rate
from quarc_ref.wording import format_count

_RATE_TOLERANCE = 1e-3  # Relative; 29.97 and 30 count as equal.
# Relative to the duration of a frame; a missing frame causes an error of 0.5.
_TIME_TOLERANCE = 0.25
_MAX_ROUNDING = 0.2  # Relative, too: a coarse time base must not hide a missing frame.
_MAX_USUAL_DURATION = 1.5  # Relative to the median; frames before a missing one last longer.
_MAX_DRIFT = 0.5  # frames; larger ones are closer to another frame
_MAX_JITTER = 0.1  # frames, between the first and last frame; rates of short videos depend on it
_MAX_DESCRIPTIONS = 5
_MAX_LOST_SHARE = 0.05  # of the frames, because of a camera that ends early
_OTHER_MATRICES = {1: "BT.709", 7: "SMPTE 240M", 9: "BT.2020", 10: "BT.2020"}  # than BT.601


def require_usable_frame_rate(frames_per_second: float) -> None:
    """Check that a stream can state the frame rate of a capture.

    Raises:
        FrameRateError: The frame rate is too low or too high, or is not a number.
    """
    if not is_frame_rate(frames_per_second):
        message = (
            f"the frame rate of the capture is {frames_per_second:g} frames per second, but it "
            f"must be from {MIN_FRAME_RATE:g} to {MAX_FRAME_RATE:,.0f}: correct 'fps' in "
            f"transforms.json, or set 'frames_per_second' in {NOTES_NAME}"
        )
        raise FrameRateError(message)


def require_common_frame_rate(videos: Sequence[VideoReader]) -> None:
    """Check that all videos have the same constant frame rate, so that they stay synchronized.

    Args:
        videos: At least one video.

    Raises:
        FrameRateError: A video has a variable frame rate, or a frame rate that differs from that
            of most videos.
    """
    _require_constant_frame_rates(videos)
    common_rate = median_high(video.frames_per_second for video in videos)
    outliers = [video for video in videos if not _has_frame_rate(video, common_rate)]
    if outliers:
        message = (
            f"{_join_descriptions([_describe_rate(video) for video in outliers])}, but the others "
            f"have {common_rate:g}: convert all videos to the same frame rate"
        )
        raise FrameRateError(message)


def compare_frame_rates(
    names: Sequence[str], rates: Sequence[float], last_frame: int
) -> Finding | None:
    """Return a finding if small differences of frame rates add up to half a frame, or None.

    Args:
        names: Names of the cameras, at least one.
        rates: `[camera]` frames per second.
        last_frame: Last frame that is used.
    """
    common_rate = median_high(rates)
    drifts = [last_frame * abs(common_rate / rate - 1) for rate in rates]
    names = tuple(name for name, drift in zip(names, drifts, strict=True) if drift > _MAX_DRIFT)
    if not names:
        return None
    message = (
        f"the frame rate of {format_names(names)} differs slightly from the {common_rate:.6g} "
        f"frames per second of other cameras, so in frame {last_frame} they are up to "
        f"{max(drifts):.1f} frames out of sync: convert the videos to that rate (ffmpeg -i OLD.mp4 "
        f"-vf fps={common_rate:.6g} NEW.mp4), or encode earlier frames"
    )
    return Finding("frame-rate", message, names)


def compare_lengths(
    names: Sequence[str], lengths: Sequence[int], offsets: Sequence[int] = ()
) -> Finding | None:
    """Return a finding if frames are lost because recordings have different lengths, or None.

    Args:
        names: Names of the cameras, at least one.
        lengths: `[camera]` number of frames of the recording.
        offsets: `[camera]` frame of the recording that becomes frame 0; empty if all are 0.
            Recordings that differ in length, but end at the same time, lose no frames.
    """
    offsets = offsets or [0] * len(names)
    common_counts = [length - offset for length, offset in zip(lengths, offsets, strict=True)]
    common_length = median_high(lengths)
    outliers = [index for index, length in enumerate(lengths) if length != common_length]
    if not outliers or len(set(common_counts)) == 1:
        return None
    descriptions = [f"{names[i]} has {format_count(lengths[i], 'frame')}" for i in outliers]
    count = min(common_counts)
    frames = f"the first {f'{count} frames' if count > 1 else 'frame'} of every camera"
    if any(offsets):
        frames = f"{format_count(count, 'frame')} of every camera, beginning at its offset,"
    message = (
        f"{_join_descriptions(descriptions)}, but the others have {common_length}: only {frames} "
        f"{'is' if count == 1 else 'are'} used{_suggest_using_others(names, common_counts)}"
    )
    return Finding(UNEVEN_LENGTHS, message, tuple(names[i] for i in outliers))


def compare_rotations(names: Sequence[str], rotations: Sequence[int]) -> Finding | None:
    """Return a finding if the cameras have different rotation flags, and None otherwise.

    Args:
        names: Names of the cameras, at least one.
        rotations: `[camera]` rotation flag, in degrees counterclockwise.
    """
    (common_rotation, _), *_ = Counter(rotations).most_common(1)
    outliers = [index for index, degrees in enumerate(rotations) if degrees != common_rotation]
    if not outliers:
        return None
    descriptions = [
        f"{names[i]} is rotated by {rotations[i] % 360} degrees counterclockwise" for i in outliers
    ]
    message = (
        f"rotation flags differ: {_join_descriptions(descriptions)}, but the others are "
        f"rotated by {common_rotation % 360} degrees. If all cameras were mounted the same way, "
        "and the poses are for the pictures as stored (those of calibrate are for rotated ones), "
        f"{FLAG_REMEDY}"
    )
    return Finding("rotation-flags", message, tuple(names[i] for i in outliers))


def find_hdr_videos(names: Sequence[str], hdr_flags: Sequence[bool]) -> Finding | None:
    """Return a finding if there are HDR videos, and None otherwise.

    Args:
        names: Names of the cameras.
        hdr_flags: `[camera]` whether the video is HDR.
    """
    hdr_names = tuple(name for name, is_hdr in zip(names, hdr_flags, strict=True) if is_hdr)
    if not hdr_names:
        return None
    message = (
        f"the videos of {format_names(hdr_names)} are HDR (PQ or HLG), but are used as if they "
        "were sRGB, so colors are wrong and mostly pale: convert them to SDR (with the filters "
        "zscale and tonemap of ffmpeg), or turn off HDR in the cameras"
    )
    return Finding("hdr-video", message, hdr_names)


def compare_color_matrices(
    names: Sequence[str], matrices: Sequence[int], hdr_flags: Sequence[bool]
) -> Finding | None:
    """Return a finding if only some videos state that their colors are not BT.601, or None.

    Args:
        names: Names of the cameras.
        matrices: `[camera]` matrix that the video states, as in `VideoReader`.
        hdr_flags: `[camera]` whether the video is HDR. These are not compared, because they have
            to be converted, and then have another matrix.
    """
    is_compared = [not is_hdr for is_hdr in hdr_flags]
    names, matrices = [*compress(names, is_compared)], [*compress(matrices, is_compared)]
    unstated = tuple(
        name for name, matrix in zip(names, matrices, strict=True) if matrix == UNSTATED_MATRIX
    )
    stated = sorted({_OTHER_MATRICES[matrix] for matrix in matrices if matrix in _OTHER_MATRICES})
    if not (unstated and stated):
        return None
    message = (
        f"the videos of {format_names(unstated)} do not state their color matrix and are read as "
        f"BT.601, but others state {' or '.join(stated)}, so the same colors are read differently: "
        "if all cameras record the same, state it in these videos as well (for BT.709: ffmpeg -i "
        "OLD.mp4 -c copy -bsf:v h264_metadata=matrix_coefficients=1 NEW.mp4)"
    )
    return Finding("color-matrices", message, unstated)


def compare_stated_rate(stated_rate: float | None, video_rate: float) -> Finding | None:
    """Return a finding if a description file states another frame rate than the videos, or None.

    Args:
        stated_rate: Frame rate that the description file states; None if it states none.
        video_rate: Frame rate of the videos.
    """
    if stated_rate is None or math.isclose(stated_rate, video_rate, rel_tol=_RATE_TOLERANCE):
        return None
    message = (
        f"transforms.json states {stated_rate:g} frames per second, but the videos have "
        f"{video_rate:g}, so the scene is played {stated_rate / video_rate:.3g} times as fast: "
        f"correct or remove 'fps', or confirm it with 'frames_per_second' in {NOTES_NAME}"
    )
    return Finding(STATED_FRAME_RATE, message)


def _suggest_using_others(names: Sequence[str], counts: Sequence[int]) -> str:
    """Return advice if a few cameras end much earlier than most others; empty if not."""
    common_count = median_high(counts)
    min_count = (1 - _MAX_LOST_SHARE) * common_count
    ends = {name: count for name, count in zip(names, counts, strict=True) if count < min_count}
    has_others = 2 * len(ends) < len(names)
    if not ends or not has_others or len(ends) > _MAX_DESCRIPTIONS or min(ends.values()) < 1:
        return ""
    return f"; {suggest_ignoring_ends(ends)}"


def _require_constant_frame_rates(videos: Sequence[VideoReader]) -> None:
    variable_videos = [video for video in videos if _has_variable_frame_rate(video)]
    if not variable_videos:
        return
    constant_rates = [video.frames_per_second for video in videos if video not in variable_videos]
    usual_rates = constant_rates or map(_find_usual_frame_rate, variable_videos)
    first_video, *other_videos = variable_videos
    shortest, *_, longest = sorted(np.diff(first_video.frame_times) * 1000)
    others = format_names([video.path.name for video in other_videos])
    message = (
        f"{first_video.path} has a variable frame rate: its frames last from {shortest:.1f} to "
        f"{longest:.1f} ms{f' (the same applies to {others})' if others else ''}; convert it "
        f"(ffmpeg -i {first_video.path.name} -vf fps={median_high(usual_rates):.5g} NEW.mp4)"
    )
    raise FrameRateError(message)


def _has_frame_rate(video: VideoReader, rate: float) -> bool:
    drift = (len(video.frame_times) - 1) * abs(rate / video.frames_per_second - 1)
    return drift <= _MAX_JITTER or math.isclose(
        video.frames_per_second, rate, rel_tol=_RATE_TOLERANCE
    )


def _has_variable_frame_rate(video: VideoReader) -> bool:
    times = video.frame_times
    if len(times) < 3:
        return False
    mean_duration = (times[-1] - times[0]) / (len(times) - 1)
    deviations = np.abs(times - np.linspace(times[0], times[-1], len(times)))
    rounding_error = min(video.time_base_seconds / 2, _MAX_ROUNDING * mean_duration)
    return bool(deviations.max() > _TIME_TOLERANCE * mean_duration + rounding_error)


def _find_usual_frame_rate(video: VideoReader) -> int:
    """Return the rate of most frames; the average rate is lower if frames are missing."""
    durations = np.diff(video.frame_times)
    usual_durations = durations[durations < _MAX_USUAL_DURATION * np.median(durations)]
    return max(1, round(1 / float(usual_durations.mean())))


def _join_descriptions(descriptions: Sequence[str]) -> str:
    joined = ", ".join(descriptions[:_MAX_DESCRIPTIONS])
    omitted_count = len(descriptions) - _MAX_DESCRIPTIONS
    return f"{joined} and {omitted_count} more differ" if omitted_count > 0 else joined


def _describe_rate(video: VideoReader) -> str:
    return f"{video.path.name} has {video.frames_per_second:g} frames per second"
