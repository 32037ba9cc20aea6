from fractions import Fraction

import av
import numpy as np
import pytest

from quarc_ref.calibration.epipolar_motion import align_by_epipolar_motion
from quarc_ref.calibration.errors import CalibrationError
from quarc_ref.calibration.offsets import SyncMethod, find_offsets
from quarc_ref.calibration.recordings import find_recordings
from quarc_ref.datasets.errors import UnreadableVideoError
from tests.calibration.rigs import LENS, make_ring
from tests.sound_files import forge_unknown_format

TRUE_DELAYS = [0, 15, 4, 0, 9, 0, 13, 1]  # number of frames by which a camera started late
SAMPLE_RATE = 16000


def ignore_progress(_done, _total):
    """Ignore progress."""


def write_with_sound(path, offset, sound, frames=90, first_time=0, silent_frames=0):
    """Write a static video, whose sound starts at `offset` frames of the given sound.

    The time stamps start at `first_time`, and those of sound `silent_frames` later, in frames.
    """
    with av.open(str(path), "w") as container:
        video = container.add_stream("libx264", Fraction(30))
        video.width, video.height, video.pix_fmt = 32, 32, "yuv420p"
        audio = container.add_stream("aac", rate=SAMPLE_RATE)
        audio.layout = "mono"
        for index in range(frames):
            frame = av.VideoFrame.from_ndarray(np.full((32, 32, 3), 99, np.uint8), "rgb24")
            frame.pts, frame.time_base = first_time + index, Fraction(1, 30)
            container.mux(video.encode(frame))
        first_sample = round((offset + silent_frames) * SAMPLE_RATE / 30)
        recorded_sound = sound[first_sample : round((offset + frames) * SAMPLE_RATE / 30)]
        first_pts = (first_time + silent_frames) * SAMPLE_RATE // 30
        for block_start in range(0, len(recorded_sound), 1024):
            block = av.AudioFrame.from_ndarray(
                recorded_sound[None, block_start : block_start + 1024], "fltp", "mono"
            )
            block.sample_rate, block.pts, block.time_base = (
                SAMPLE_RATE,
                first_pts + block_start,
                Fraction(1, SAMPLE_RATE),
            )
            container.mux(audio.encode(block))
        container.mux(video.encode(None))
        container.mux(audio.encode(None))


def make_sound(seconds=5):
    random = np.random.default_rng(3)
    loudness = np.repeat(random.random(seconds * 20) ** 3, SAMPLE_RATE // 20)
    return (0.3 * loudness * random.standard_normal(len(loudness))).astype(np.float32)


def max_error(offsets):
    """Return the maximum error of offsets in frames, after the best common shift."""
    errors = np.array(offsets) + TRUE_DELAYS
    return np.abs(errors - np.median(errors)).max()


def test_planted_offsets_are_found_by_sound(tmp_path):
    sound = make_sound()
    for index, offset in enumerate(TRUE_DELAYS):
        write_with_sound(tmp_path / f"cam{index}.mp4", offset, sound)

    estimated, motions = find_offsets(find_recordings(tmp_path), SyncMethod.AUTO, ignore_progress)

    assert estimated.method is SyncMethod.SOUND
    assert estimated.unreliable_cameras == []
    assert max_error(list(estimated.frame_offsets.values())) < 0.5
    assert motions == {}


def test_offsets_that_are_found_by_sound_are_finer_than_a_frame(tmp_path):
    delays, sound = np.array([0, 4.5, 9.25, 2.75]), make_sound()
    for index, delay in enumerate(delays):
        write_with_sound(tmp_path / f"cam{index}.mp4", delay, sound)

    estimated, _ = find_offsets(find_recordings(tmp_path), SyncMethod.SOUND, ignore_progress)

    errors = np.array(list(estimated.written_offsets.values())) + delays
    assert np.ptp(errors) < 0.1


def test_sound_may_begin_later_than_the_pictures_and_both_later_than_the_container(tmp_path):
    sound = make_sound()
    for index, offset in enumerate(TRUE_DELAYS):
        write_with_sound(
            tmp_path / f"cam{index}.mp4", offset, sound,
            first_time=9 * (index % 2), silent_frames=10 * (index % 3),
        )  # fmt: skip

    estimated, _ = find_offsets(find_recordings(tmp_path), SyncMethod.SOUND, ignore_progress)

    assert max_error(list(estimated.frame_offsets.values())) < 0.5


def test_a_stated_frame_rate_does_not_change_offsets_that_are_found_by_sound(tmp_path):
    sound = make_sound()
    for index, offset in enumerate(TRUE_DELAYS):
        write_with_sound(tmp_path / f"cam{index}.mp4", offset, sound)

    recordings = find_recordings(tmp_path, frames_per_second=60)
    estimated, _ = find_offsets(recordings, SyncMethod.SOUND, ignore_progress)

    assert max_error(list(estimated.frame_offsets.values())) < 0.5


def draw_motion(camera, positions):
    """Return the motion in a camera's pictures: one picture with a blob per position."""
    y, x = np.indices((24, 32)) * 2 + 1.0
    pictures = []
    for position in positions:
        right, down, forward = camera.pose.rotation @ position + camera.pose.translation
        u, v = LENS.fx * right / forward + LENS.cx, LENS.fy * down / forward + LENS.cy
        pictures.append(20 * np.exp(-((x - u) ** 2 + (y - v) ** 2) / 18))
    return np.float32(pictures)


def test_planted_offsets_are_found_by_motion(monkeypatch):
    monkeypatch.setattr(
        "quarc_ref.calibration.epipolar_motion.find_downscale_factor", lambda _width: 2
    )
    random = np.random.default_rng(1)
    steps = 0.12 * random.standard_normal((75, 3)) * [1, 0.6, 1]
    walk = np.clip(np.cumsum(steps, axis=0), -0.8, 0.8)
    cameras = make_ring(len(TRUE_DELAYS))
    motions = [
        draw_motion(camera, walk[offset : offset + 60])
        for camera, offset in zip(cameras, TRUE_DELAYS, strict=True)
    ]

    estimated = align_by_epipolar_motion(cameras, motions, 20, 2)

    assert max_error([shift.samples for shift in estimated]) < 0.5
    assert min(shift.confidence for shift in estimated) > 2


def test_silent_recordings_cannot_be_synchronized_by_sound(traced_rig):
    with pytest.raises(CalibrationError, match="no sound in the recordings of cameras cam00"):
        find_offsets(find_recordings(traced_rig.folder), SyncMethod.SOUND, ignore_progress)


def test_offsets_are_found_by_motion_if_a_sound_cannot_be_decoded(tmp_path):
    for index in range(3):
        write_with_sound(tmp_path / f"cam{index}.mp4", 0, make_sound(), frames=30)
    forge_unknown_format(tmp_path / "cam1.mp4")
    recordings = find_recordings(tmp_path)
    estimated, motions = find_offsets(recordings, SyncMethod.AUTO, ignore_progress)

    assert (estimated.method, len(motions)) == (SyncMethod.MOTION, 3)
    assert "no decoder is available for the sound of" in estimated.sound_problem
    assert "cam1.mp4" in estimated.sound_problem
    with pytest.raises(UnreadableVideoError, match=r"the sound of .*cam1\.mp4"):
        find_offsets(recordings, SyncMethod.SOUND, ignore_progress)


def test_recordings_of_a_single_moment_have_no_offsets(traced_rig):
    estimated, _ = find_offsets(
        find_recordings(traced_rig.folder), SyncMethod.AUTO, ignore_progress
    )

    assert estimated.method is SyncMethod.NONE
    assert set(estimated.frame_offsets.values()) == {0.0}
