"""Writes videos with sound, and WAV files."""

import io
import wave
from fractions import Fraction

import av
import numpy as np

SAMPLE_RATE = 48000
CLICK_TIME = 1.0  # of the only sound, seconds after the first sample
_SAMPLE_FORMATS = {"aac": "fltp", "libopus": "flt", "pcm_s16le": "s16"}


def write_video(path, sound_codec, sound_delay=0.0, picture_delay=0.0, seconds=2, sound_count=1):
    """Write a gray video, with a click as its sounds; `sound_codec` is None for no sound."""
    with av.open(str(path), "w") as container:
        video = container.add_stream("libx264", Fraction(30))
        video.width, video.height, video.pix_fmt = 32, 32, "yuv420p"
        sounds = []
        for _ in range(sound_count if sound_codec is not None else 0):
            sounds.append(container.add_stream(sound_codec, rate=SAMPLE_RATE))
            sounds[-1].layout = "mono"
        for index in range(30 * seconds):
            frame = av.VideoFrame.from_ndarray(np.full((32, 32, 3), 99, np.uint8), "rgb24")
            frame.pts, frame.time_base = index + round(30 * picture_delay), Fraction(1, 30)
            container.mux(video.encode(frame))
        container.mux(video.encode(None))
        for sound in sounds:
            for block in _make_blocks(_SAMPLE_FORMATS[sound_codec], sound_delay, seconds):
                container.mux(sound.encode(block))
            container.mux(sound.encode(None))


def forge_unknown_format(path):
    """Give the first AAC sound of an mp4 file a format that FFmpeg cannot decode: Apple's APAC."""
    data = path.read_bytes()
    path.write_bytes(data.replace(b"mp4a", b"apac", 1).replace(b"esds", b"free", 1))


def _make_blocks(sample_format, delay, seconds):
    times = np.arange(SAMPLE_RATE * seconds) / SAMPLE_RATE
    samples = 0.3 * np.sin(2000 * times) * (np.abs(times - CLICK_TIME) < 0.01)
    samples = np.int16(32767 * samples) if sample_format == "s16" else np.float32(samples)
    for begin in range(0, len(samples), 960):
        block = av.AudioFrame.from_ndarray(
            samples[None, begin : begin + 960], sample_format, "mono"
        )
        block.sample_rate, block.time_base = SAMPLE_RATE, Fraction(1, SAMPLE_RATE)
        block.pts = begin + round(delay * SAMPLE_RATE)
        yield block


def find_click(data):
    """Return the name of the codec, and the time of the click of `write_video`, seconds."""
    with av.open(io.BytesIO(data)) as container:
        stream = container.streams.audio[0]
        frames = list(container.decode(stream))
        samples = np.abs(np.concatenate([frame.to_ndarray()[0] for frame in frames]))
        loud = np.flatnonzero(samples > samples.max() / 3)
        time = frames[0].time + (loud[0] + loud[-1]) / 2 / stream.rate
        return stream.codec.canonical_name, time


def make_wav(seconds=0.1):
    """Return a silent WAV file."""
    sink = io.BytesIO()
    with wave.open(sink, "wb") as file:
        file.setparams((1, 2, 8000, 0, "NONE", ""))
        file.writeframes(bytes(2 * round(8000 * seconds)))
    return sink.getvalue()
