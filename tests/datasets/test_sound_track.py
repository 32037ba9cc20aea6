import pytest

from quarc_ref.datasets.errors import MissingFileError, NoSoundError, UnreadableVideoError
from quarc_ref.datasets.sound_track import extract_sound_track
from tests.sound_files import CLICK_TIME, find_click, forge_unknown_format, write_video


@pytest.mark.parametrize(
    ("name", "codec", "expected_format"),
    [
        ("a.mp4", "aac", ("m4a", "aac")),
        ("a.mkv", "libopus", ("webm", "opus")),
        ("a.mov", "pcm_s16le", ("m4a", "aac")),
    ],
)
@pytest.mark.parametrize(("sound_delay", "picture_delay"), [(0, 0), (0.5, 0), (0, 0.5)])
def test_the_sound_keeps_its_time_after_the_first_picture(
    name, codec, expected_format, sound_delay, picture_delay, tmp_path
):
    write_video(tmp_path / name, codec, sound_delay, picture_delay)
    track = extract_sound_track(tmp_path / name)
    found_codec, time = find_click(track.data)

    assert (track.suffix, found_codec) == expected_format
    assert track.start + time == pytest.approx(CLICK_TIME + sound_delay - picture_delay, abs=0.03)


def test_aac_is_copied_without_another_loss(tmp_path):
    write_video(tmp_path / "a.mp4", "aac")
    first_track = extract_sound_track(tmp_path / "a.mp4")
    (tmp_path / "a.m4a").write_bytes(first_track.data)

    assert extract_sound_track(tmp_path / "a.m4a") == first_track


def test_a_video_without_sound_is_an_error(tmp_path):
    write_video(tmp_path / "a.mp4", None)

    with pytest.raises(NoSoundError, match=r"a\.mp4 has no sound"):
        extract_sound_track(tmp_path / "a.mp4")


def test_a_file_that_is_missing_or_no_video_is_an_error(tmp_path):
    (tmp_path / "text.mp4").write_text("text" * 1000)
    for name, error in [("missing.mp4", MissingFileError), ("text.mp4", UnreadableVideoError)]:
        with pytest.raises(error, match=name):
            extract_sound_track(tmp_path / name)


def test_a_sound_without_a_decoder_is_passed_over(tmp_path):
    write_video(tmp_path / "a.mp4", "aac", sound_count=2)
    forge_unknown_format(tmp_path / "a.mp4")

    assert find_click(extract_sound_track(tmp_path / "a.mp4").data)[0] == "aac"
