from fractions import Fraction

import av
import numpy as np
import pytest

from quarc_ref.calibration.epipolar_motion import align_by_epipolar_motion
from quarc_ref.calibration.errors import CalibrationError
from quarc_ref.calibration.offsets import SyncMethod, find_offsets
from quarc_ref.calibration.recordings import find_recordings
from tests.calibration.rigs import LENS, ring

PLANTED = [0, 15, 4, 0, 9, 0, 13, 1]  # number of frames by which a camera started late
RATE = 16000


def ignore(_done, _total):
    """Ignore progress."""


def write_with_sound(path, offset, sound, frames=90):
    """A static video with a part of a sound that starts `offset` frames late."""
    with av.open(str(path), "w") as container:
        video = container.add_stream("libx264", Fraction(30))
        video.width, video.height, video.pix_fmt = 32, 32, "yuv420p"
        audio = container.add_stream("aac", rate=RATE)
        audio.layout = "mono"
        for index in range(frames):
            frame = av.VideoFrame.from_ndarray(np.full((32, 32, 3), 99, np.uint8), "rgb24")
            frame.pts, frame.time_base = index, Fraction(1, 30)
            container.mux(video.encode(frame))
        first = offset * RATE // 30
        heard = sound[first : first + frames * RATE // 30]
        for begin in range(0, len(heard), 1024):
            block = av.AudioFrame.from_ndarray(heard[None, begin : begin + 1024], "fltp", "mono")
            block.sample_rate, block.pts, block.time_base = RATE, begin, Fraction(1, RATE)
            container.mux(audio.encode(block))
        container.mux(video.encode(None))
        container.mux(audio.encode(None))


def make_sound(seconds=5):
    random = np.random.default_rng(3)
    loudness = np.repeat(random.random(seconds * 20) ** 3, RATE // 20)
    return (0.3 * loudness * random.standard_normal(len(loudness))).astype(np.float32)


def errors_of(found):
    """Errors of offsets in frames, after the best common shift."""
    wrong = np.array(found) + PLANTED
    return np.abs(wrong - np.median(wrong)).max()


def test_planted_offsets_are_found_by_sound(tmp_path):
    sound = make_sound()
    for index, offset in enumerate(PLANTED):
        write_with_sound(tmp_path / f"cam{index}.mp4", offset, sound)

    found, motions = find_offsets(find_recordings(tmp_path), SyncMethod.AUTO, ignore)

    assert found.method is SyncMethod.SOUND
    assert found.unreliable == []
    assert errors_of(list(found.frames.values())) < 0.5
    assert motions == {}


def draw_motion(camera, places):
    """Motion as a camera sees it: a blob at each position."""
    y, x = np.indices((24, 32)) * 2 + 1.0
    drawn = []
    for place in places:
        right, down, forward = camera.pose.rotation @ place + camera.pose.translation
        u, v = LENS.fx * right / forward + LENS.cx, LENS.fy * down / forward + LENS.cy
        drawn.append(20 * np.exp(-((x - u) ** 2 + (y - v) ** 2) / 18))
    return np.float32(drawn)


def test_planted_offsets_are_found_by_motion(monkeypatch):
    monkeypatch.setattr("quarc_ref.calibration.epipolar_motion.find_step", lambda _width: 2)
    random = np.random.default_rng(1)
    steps = 0.12 * random.standard_normal((75, 3)) * [1, 0.6, 1]
    walk = np.clip(np.cumsum(steps, axis=0), -0.8, 0.8)
    cameras = ring(len(PLANTED))
    motions = [
        draw_motion(camera, walk[offset : offset + 60])
        for camera, offset in zip(cameras, PLANTED, strict=True)
    ]

    found = align_by_epipolar_motion(cameras, motions, 20, 2)

    assert errors_of([shift.samples for shift in found]) < 0.5
    assert min(shift.confidence for shift in found) > 2


def test_silent_recordings_cannot_be_synchronized_by_sound(traced):
    with pytest.raises(CalibrationError, match="cannot synchronize by sound: cam00"):
        find_offsets(find_recordings(traced.folder), SyncMethod.SOUND, ignore)


def test_recordings_of_a_single_moment_have_no_offsets(traced):
    found, _ = find_offsets(find_recordings(traced.folder), SyncMethod.AUTO, ignore)

    assert found.method is SyncMethod.NONE
    assert set(found.frames.values()) == {0.0}
