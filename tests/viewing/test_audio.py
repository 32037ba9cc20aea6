import os

import pytest

from quarc_ref.viewing.audio import AudioFileError, read_audio
from tests.sound_files import find_click, make_wav, write_video


@pytest.mark.parametrize(
    ("head", "name", "media_type"),
    [
        (b"RIFF\x24\0\0\0WAVEfmt ", "audio.wav", "audio/wav"),
        (b"OggS\0\2", "audio.ogg", "audio/ogg"),
        (b"fLaC\0\0\0\x22", "audio.flac", "audio/flac"),
        (b"ID3\4\0\0", "audio.mp3", "audio/mpeg"),
        (b"\xff\xfb\x90\x64", "audio.mp3", "audio/mpeg"),
        (b"\xff\xf3\x40\xc4", "audio.mp3", "audio/mpeg"),
        (b"\xff\xf1\x50\x80", "audio.aac", "audio/aac"),
    ],
)
def test_audio_is_recognized_by_its_content_and_copied(head, name, media_type, tmp_path):
    path = tmp_path / "50% #ä.bin"  # the name on the page is another one
    path.write_bytes(head + bytes(100))
    audio = read_audio(path, 1.5)

    assert audio.data == path.read_bytes()
    assert (audio.name, audio.media_type, audio.start) == (name, media_type, 1.5)


def test_the_sound_of_a_video_starts_relative_to_its_first_picture(tmp_path):
    write_video(tmp_path / "a.mp4", "aac", sound_delay=0.5)
    audio = read_audio(tmp_path / "a.mp4", 2.0)

    assert find_click(audio.data)[0] == "aac"
    assert (audio.name, audio.media_type) == ("audio.m4a", "audio/mp4")
    assert audio.start == pytest.approx(1.5, abs=0.03)


@pytest.mark.parametrize(
    "data", [b"", b"\xff", b"text", b"\xff\xfet\0e\0x\0t\0", b"\x89PNG\r\n\x1a\n"]
)
def test_a_file_that_is_neither_audio_nor_a_video_is_an_error(data, tmp_path):
    path = tmp_path / "a.mp3"
    path.write_bytes(data)

    with pytest.raises(AudioFileError, match=r"a\.mp3 is neither an audio file"):
        read_audio(path, 0)


def test_a_path_that_is_no_file_is_an_error(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for name, message in [("", "is not a file"), ("pipe", "is not a file"), ("x", "not exist")]:
        with pytest.raises(AudioFileError, match=message):
            read_audio(tmp_path / name, 0)


def test_a_file_that_is_too_large_is_an_error(tmp_path, monkeypatch):
    path = tmp_path / "a.wav"
    path.write_bytes(make_wav())
    for limit, is_too_large in [(path.stat().st_size, False), (path.stat().st_size - 1, True)]:
        monkeypatch.setattr("quarc_ref.viewing.audio._MAX_BYTES", limit)
        if is_too_large:
            with pytest.raises(AudioFileError, match="convert it to m4a"):
                read_audio(path, 0)
        else:
            assert read_audio(path, 0).data == path.read_bytes()
