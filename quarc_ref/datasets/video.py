"""Decodes videos, which the module `media` opens.

Ground-truth pictures are the output of PyAV's `frame.to_ndarray(format="rgb24")`: FFmpeg's scaler
upsamples chroma and converts to RGB with its default settings, except for video with more than 8
bits (`rotate_upright`). Frames are numbered in the order of their timestamps. The number of frames
is found by counting packets, because headers can be wrong. Only one thread may use a `VideoReader`
at a time.
"""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import av
import numpy as np
from av.container import InputContainer
from av.video.reformatter import ColorTrc
from av.video.stream import VideoStream

from quarc_ref.datasets.calibration import Float64Array
from quarc_ref.datasets.capture import Image
from quarc_ref.datasets.cut_files import is_cut_off
from quarc_ref.datasets.errors import TruncatedVideoError, UnreadableVideoError
from quarc_ref.datasets.media import open_video
from quarc_ref.datasets.orientation import require_unmirrored, rotate_upright
from quarc_ref.wording import format_count

UNSTATED_MATRIX = 2
_HDR_TRANSFERS = (ColorTrc.SMPTE2084, ColorTrc.ARIB_STD_B67)  # PQ and HLG


class VideoReader:
    """Reads a video, and decodes its frames on demand.

    Sequential reading is fastest. To read any other frame, the reader decodes all frames from the
    preceding key frame to the requested frame.

    Args:
        path: Path of a file in a format with timestamps: mp4, mov, mkv or webm.

    Attributes:
        path: Path of the file.
        width: Width of the upright pictures, pixels.
        height: Height of the upright pictures, pixels.
        frames_per_second: Average frame rate. The duration of the last frame does not count,
            because it is often wrong.
        rotation: Degrees counterclockwise by which pictures are rotated upright.
        is_hdr: Whether the levels are those of HDR, which are not converted to sRGB.
        color_matrix: Code of the matrix from RGB to YCbCr, as in H.273; `UNSTATED_MATRIX` if the
            video does not state it and is read as BT.601.
        pixel_aspect: Width of a pixel of the upright pictures, divided by its height; 1 if the
            video does not state it.
        frame_count: Number of frames in the file.
        frame_times: `[frame_count]` times in seconds, ascending.
        time_base_seconds: Time base of the video in seconds; every frame time is a multiple of it.

    Raises:
        MissingFileError: The file does not exist.
        TruncatedVideoError: The file is truncated.
        UnreadableVideoError: The file is not a decodable video, or its pictures cannot be
            rotated upright.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._container, self._stream = open_video(path)
        self.time_base_seconds = float(self._stream.time_base or 0)
        packets = _list_packets(self._container, self._stream, path)
        self._timestamps = sorted(packet.time for packet in packets if packet.is_shown)
        self._key_packets = sorted(packet for packet in packets if packet.is_key)
        self.frame_count = len(self._timestamps)
        self.frames_per_second = self._measure_frame_rate()
        self._frames: Iterator[av.VideoFrame] = iter(())
        self._next_frame = self.frame_count
        self.height, self.width = self.read(0).shape[:2]
        stored_aspect = float(self._stream.sample_aspect_ratio or 1)
        self.pixel_aspect = 1 / stored_aspect if self.rotation % 180 else stored_aspect
        self._release_decoder()

    @property
    def frame_times(self) -> Float64Array:
        """`[frame_count]` times in seconds, ascending."""
        return np.array(self._timestamps) * self.time_base_seconds

    def read(self, frame: int) -> Image:
        """Return frame `frame` as `[H, W, 3]` sRGB.

        Raises:
            TruncatedVideoError: The video has fewer frames.
            UnreadableVideoError: The frame is damaged, or cannot be rotated upright.
        """
        if not 0 <= frame < self.frame_count:
            length = format_count(self.frame_count, "frame")
            message = f"{self.path} has no frame {frame}: it has {length}"
            raise TruncatedVideoError(message)
        try:
            decoded = self._decode(frame)
            if decoded is None or decoded.is_corrupt:
                decoded = self._decode(frame, is_retry=True)
        except av.FFmpegError as error:
            reason = error.strerror
            message = f"frame {frame} of {self.path} cannot be decoded ({reason}): export it again"
            raise UnreadableVideoError(message) from error
        if decoded is None or decoded.is_corrupt:
            message = f"frame {frame} of {self.path} is damaged: export the video again"
            raise UnreadableVideoError(message)
        self._next_frame = frame + 1
        self.rotation = decoded.rotation
        self.is_hdr = decoded.color_trc in _HDR_TRANSFERS
        self.color_matrix = int(decoded.colorspace)
        try:
            if frame == 0:  # all frames of a video have its display matrix
                require_unmirrored(decoded)
            return rotate_upright(decoded)
        except (av.FFmpegError, ValueError) as error:
            message = (
                f"frame {frame} of {self.path} cannot be used: {error}; export the video with "
                "upright pictures"
            )
            raise UnreadableVideoError(message) from error

    def _measure_frame_rate(self) -> float:
        """Return the rate in the header if the first and last time match it, else their rate."""
        stated_rate = float(self._stream.average_rate or 0)
        duration = float(self.frame_times[-1] - self.frame_times[0])
        step_count = self.frame_count - 1
        max_rounding = stated_rate * self.time_base_seconds
        if not duration or abs(stated_rate * duration - step_count) <= max_rounding:
            return stated_rate
        return step_count / duration

    def _release_decoder(self) -> None:
        """Replace the decoder with a new one, which has no frame buffers until the next `read`."""
        self._container, self._stream = open_video(self.path)
        self._frames, self._next_frame = iter(()), self.frame_count

    def _decode(self, frame: int, *, is_retry: bool = False) -> av.VideoFrame | None:
        """Return the decoded frame, or None if the decoder drops it.

        A retry starts one key frame earlier: if blocks are refreshed little by little, a picture is
        complete only some frames after the key frame.
        """
        target_time = self._timestamps[frame]
        key_index = bisect_right(self._key_packets, target_time, key=lambda packet: packet.time) - 1
        key_packet = self._key_packets[max(0, key_index - is_retry)]
        if (
            is_retry
            or not bisect_left(self._timestamps, key_packet.time) <= self._next_frame <= frame
        ):
            self._container.seek(key_packet.decode_time, stream=self._stream)
            self._frames = self._container.decode(self._stream)
        # If decoding fails, `_next_frame` keeps this value, which makes the next read seek.
        self._next_frame = self.frame_count
        for decoded in self._frames:
            if decoded.pts is not None and decoded.pts >= target_time:
                return decoded if decoded.pts == target_time else None
        return None


class _Packet(NamedTuple):
    """A coded frame, ordered by presentation time; `is_shown` is False for trimmed frames."""

    time: int
    decode_time: int
    duration: int
    is_key: bool
    is_shown: bool


def _list_packets(container: InputContainer, stream: VideoStream, path: Path) -> list[_Packet]:
    """Return the packets of a video in decoding order; check their number against the header."""
    try:
        packets = [
            _make_packet(packet, path)
            for packet in container.demux(stream)
            if packet.size and not packet.is_corrupt
        ]
    except av.FFmpegError as error:
        message = f"{path} is truncated ({error}): copy or export it again"
        raise TruncatedVideoError(message) from error
    if is_cut_off(path):
        message = f"{path} is truncated: its end is missing; copy or export it again"
        raise TruncatedVideoError(message)
    if not packets or _is_truncated(packets, stream):
        message = (
            f"{path} is truncated: it has {len(packets)} of the {max(1, stream.frames)} "
            "frames that its header states; copy or export it again"
        )
        raise TruncatedVideoError(message)
    if len({packet.time for packet in packets}) < len(packets) or not packets[0].is_key:
        message = (
            f"{path} has two frames with the same time, or does not start with a key frame: export "
            "it again"
        )
        raise UnreadableVideoError(message)
    return packets


def _make_packet(packet: "av.Packet[VideoStream]", path: Path) -> _Packet:
    if packet.pts is None:
        message = f"{path} has frames without timestamps: convert it to an mp4 file"
        raise UnreadableVideoError(message)
    duration = packet.duration or 0
    decode_time = packet.pts if packet.dts is None else packet.dts
    return _Packet(packet.pts, decode_time, duration, packet.is_keyframe, not packet.is_discard)


def _is_truncated(packets: list[_Packet], stream: VideoStream) -> bool:
    """Return whether the header states more frames and a longer duration than the packets have.

    The duration is checked as well, because the header of a video that was trimmed without
    re-encoding states too many frames, but the correct duration.
    """
    shown_durations = [packet.duration for packet in packets if packet.is_shown]
    max_duration = sum(shown_durations) + max(shown_durations, default=0) / 2
    return len(packets) < stream.frames and max_duration < (stream.duration or math.inf)
