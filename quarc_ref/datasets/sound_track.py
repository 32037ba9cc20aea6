"""Extracts the sound of a video as an audio file that browsers play."""

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import av
from av.audio.stream import AudioStream
from av.container import InputContainer, OutputContainer

from quarc_ref.datasets.errors import NoSoundError, UnreadableVideoError
from quarc_ref.datasets.media import find_audio_stream, find_video_stream, open_media

_COPIED_CODECS: dict[str, Literal["m4a", "webm"]] = {"aac": "m4a", "opus": "webm"}
_MUXERS = {"m4a": "ipod", "webm": "webm"}
_SAMPLES_PER_SECOND = 48000  # of sound that is encoded again
_BITS_PER_SECOND = 160_000


@dataclass(frozen=True, slots=True)
class SoundTrack:
    """The sound of a video as a file.

    Attributes:
        data: The file.
        suffix: `m4a` for AAC, `webm` for Opus.
        start: Time of the beginning of the file after the first picture of the video, seconds.
    """

    data: bytes
    suffix: Literal["m4a", "webm"]
    start: float


def extract_sound_track(path: Path) -> SoundTrack:
    """Copy the first sound of a video that can be decoded; encode it unless it is AAC or Opus.

    Args:
        path: Path of an mp4, m4a, mov, mkv or webm file.

    Raises:
        MissingFileError: The file does not exist, or cannot be read.
        NoSoundError: The video has no sound.
        TruncatedVideoError: The file ends before its frame table.
        UnreadableVideoError: The file is not a supported video, or its sound cannot be decoded.
    """
    with open_media(path) as container:
        stream = find_audio_stream(container, path)
        if stream is None:
            message = f"{path} has no sound"
            raise NoSoundError(message)
        suffix = _COPIED_CODECS.get(stream.codec.canonical_name)
        sink = io.BytesIO()
        try:
            with av.open(sink, "w", _MUXERS[suffix or "m4a"], {"fflags": "+bitexact"}) as output:
                write = _encode if suffix is None else _copy
                start = write(container, stream, output)
        except av.FFmpegError as error:
            message = f"the sound of {path} cannot be read ({error}): export the video again"
            raise UnreadableVideoError(message) from error
        if start is None:
            message = f"the sound of {path} is empty"
            raise NoSoundError(message)
        return SoundTrack(sink.getvalue(), suffix or "m4a", start - _first_picture_time(container))


def _first_picture_time(container: InputContainer) -> float:
    stream = find_video_stream(container)
    if stream is None or stream.start_time is None or stream.time_base is None:
        return 0.0
    return float(stream.start_time * stream.time_base)


def _copy(container: InputContainer, stream: AudioStream, output: OutputContainer) -> float | None:
    """Copy all packets, moved to time 0; return their start time, or None if there are none."""
    track = output.add_stream_from_template(stream)
    start = None
    for packet in container.demux(stream):
        if packet.pts is None or packet.dts is None:  # the packet after the last
            continue
        if start is None:
            start = max(0, packet.pts)  # Players skip what comes before time 0.
        packet.pts, packet.dts, packet.stream = packet.pts - start, packet.dts - start, track
        output.mux(packet)
    return None if start is None or stream.time_base is None else float(start * stream.time_base)


def _encode(
    container: InputContainer, stream: AudioStream, output: OutputContainer
) -> float | None:
    """Encode the sound as AAC from time 0; return its start time, or None if there is no sound."""
    layout = "mono" if stream.codec_context.channels == 1 else "stereo"
    track = output.add_stream("aac", rate=_SAMPLES_PER_SECOND, layout=layout)
    track.bit_rate = _BITS_PER_SECOND
    resampler = av.AudioResampler(format="fltp", layout=layout, rate=_SAMPLES_PER_SECOND)
    start, sample_count = None, 0
    for frame in container.decode(stream):
        if start is None:
            start = 0.0 if frame.time is None else frame.time
        for block in resampler.resample(frame):
            block.pts, sample_count = sample_count, sample_count + block.samples
            output.mux(track.encode(block))
    output.mux(track.encode(None))
    return start
