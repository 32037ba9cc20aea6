import pytest

from quarc_ref.datasets.errors import TruncatedVideoError, UnreadableVideoError
from quarc_ref.datasets.video import VideoReader
from tests.datasets import scenes

FRAME_COUNT = scenes.VIDEO_FRAME_COUNT


def test_a_video_without_its_end_is_truncated(video, tmp_path):
    data = video.read_bytes()
    path = tmp_path / "cut.mp4"
    path.write_bytes(data[: len(data) * 3 // 4])

    with pytest.raises(TruncatedVideoError, match=rf"is truncated.* of the {FRAME_COUNT} frames"):
        VideoReader(path)


@pytest.mark.parametrize("count", [8, 9, 10, 11])
def test_a_video_without_its_last_byte_is_truncated(tmp_path, decoded_frames, count):
    path = tmp_path / "cut.mp4"
    scenes.write_video(path, decoded_frames[:count], faststart=True)
    path.write_bytes(path.read_bytes()[:-1])

    with pytest.raises(TruncatedVideoError, match=f"has {count - 1} of the {count}"):
        VideoReader(path)


def test_a_video_cut_before_its_table_of_frames_is_named(tmp_path, decoded_frames):
    path = tmp_path / "cut.mp4"
    scenes.write_video(path, decoded_frames)
    path.write_bytes(path.read_bytes()[:-100])

    with pytest.raises(TruncatedVideoError, match=r"cut.mp4 is truncated"):
        VideoReader(path)


@pytest.mark.parametrize("kept_fraction", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("mdat_size", [None, 0, 1])
def test_a_recording_that_was_cut_off_is_truncated(
    tmp_path, decoded_frames, kept_fraction, mdat_size
):
    path = tmp_path / "cut.mp4"
    scenes.write_video(path, decoded_frames)
    data = bytearray(path.read_bytes())
    start, end = data.index(b"mdat") - 4, data.index(b"moov") - 4
    if mdat_size is not None:  # 0 is that of an unfinished file, 1 means a size with 64 bits
        data[start : start + 4] = mdat_size.to_bytes(4)
        data[start + 8 : start + 16] = (end - start).to_bytes(8)
    path.write_bytes(data[: start + 16 + int(kept_fraction * (end - start - 16))])

    with pytest.raises(TruncatedVideoError, match=r"cut.mp4 is truncated .*: copy or export"):
        VideoReader(path)


def test_a_damaged_video_with_a_frame_table_is_not_called_truncated(tmp_path, decoded_frames):
    path = tmp_path / "damaged.mp4"
    scenes.write_video(path, decoded_frames)
    path.write_bytes(path.read_bytes().replace(b"trak", b"krat"))

    with pytest.raises(UnreadableVideoError):
        VideoReader(path)


def test_every_cut_of_a_video_is_rejected_by_name(video, tmp_path):
    data = video.read_bytes()
    path = tmp_path / "cut.mp4"

    for length in range(0, len(data), 97):
        path.write_bytes(data[:length])
        with pytest.raises((TruncatedVideoError, UnreadableVideoError), match=r"cut.mp4"):
            VideoReader(path)


def test_every_cut_within_the_table_of_frames_is_called_truncated(tmp_path, decoded_frames):
    path = tmp_path / "cut.mp4"
    scenes.write_video(path, decoded_frames)
    data = path.read_bytes()

    for length in range(data.index(b"moov"), data.index(b"stco"), 23):
        path.write_bytes(data[:length])
        with pytest.raises(TruncatedVideoError, match=r"cut.mp4 is truncated"):
            VideoReader(path)


def test_an_empty_video_is_named(tmp_path):
    path = tmp_path / "cam00.mp4"
    path.touch()

    with pytest.raises(TruncatedVideoError, match=r"cam00.mp4 is empty: copy it from the camera"):
        VideoReader(path)
