import numpy as np
import pytest

from quarc_ref.datasets.errors import UnreadableVideoError
from quarc_ref.datasets.sound import read_sound
from tests.sound_files import CLICK_TIME, forge_unknown_format, write_video

_RATE = 8000


@pytest.mark.parametrize(("name", "codec"), [("a.mp4", "aac"), ("a.mov", "pcm_s16le")])
@pytest.mark.parametrize(("sound_delay", "picture_delay"), [(0, 0), (0.5, 0), (0, 0.5)])
def test_sound_is_on_the_timeline_of_the_container(
    name, codec, sound_delay, picture_delay, tmp_path
):
    write_video(tmp_path / name, codec, sound_delay, picture_delay)
    sound = read_sound(tmp_path / name, _RATE, 10.0)
    loud = np.flatnonzero(np.abs(sound.samples) > 0.1)

    time = sound.start + (loud[0] + loud[-1]) / 2 / sound.samples_per_second
    assert sound.samples_per_second == _RATE
    assert time == pytest.approx(CLICK_TIME + sound_delay, abs=0.03)


@pytest.mark.parametrize("max_seconds", [0.1, 0.7])
def test_no_more_sound_than_needed_is_read(max_seconds, tmp_path):
    write_video(tmp_path / "a.mp4", "aac")
    sound = read_sound(tmp_path / "a.mp4", _RATE, max_seconds)

    frame_seconds = 1024 / 48000
    assert max_seconds <= len(sound.samples) / _RATE < max_seconds + frame_seconds + 0.001


def test_a_video_without_sound_has_none(tmp_path):
    write_video(tmp_path / "a.mp4", None)

    assert read_sound(tmp_path / "a.mp4", _RATE, 10.0) is None


def test_a_sound_without_a_decoder_is_passed_over(tmp_path):
    write_video(tmp_path / "a.mp4", "aac", sound_count=2)
    expected = read_sound(tmp_path / "a.mp4", _RATE, 10.0)
    forge_unknown_format(tmp_path / "a.mp4")

    assert np.array_equal(read_sound(tmp_path / "a.mp4", _RATE, 10.0).samples, expected.samples)
    forge_unknown_format(tmp_path / "a.mp4")
    with pytest.raises(UnreadableVideoError, match=r"no decoder .* for the sound of .*a\.mp4"):
        read_sound(tmp_path / "a.mp4", _RATE, 10.0)
