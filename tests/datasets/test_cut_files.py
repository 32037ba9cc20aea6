import pytest

from quarc_ref.datasets.cut_files import is_cut_off
from quarc_ref.datasets.errors import TruncatedVideoError
from quarc_ref.datasets.video import VideoReader
from tests.datasets.layouts.builders import remux

FRAGMENTS = {"movflags": "frag_keyframe+empty_moov"}


@pytest.fixture(params=[("a.mkv", {}), ("a.mp4", FRAGMENTS)], ids=["mkv", "fragments"])
def path(request, tmp_path, n3dv_folder):
    name, options = request.param
    remux(n3dv_folder / "cam00.mp4", tmp_path / name, **options)
    return tmp_path / name


@pytest.mark.parametrize("kept_fraction", [0.6, 0.8, 0.9])
def test_a_video_without_its_end_is_truncated(path, kept_fraction):
    data = path.read_bytes()
    assert VideoReader(path).frame_count == 6
    path.write_bytes(data[: int(kept_fraction * len(data))])

    with pytest.raises(TruncatedVideoError, match=r"is truncated: its end is missing"):
        VideoReader(path)


def test_bytes_after_the_end_do_not_matter(path):
    path.write_bytes(path.read_bytes() + b"\xff" * 99)

    assert VideoReader(path).frame_count == 6


def test_a_live_recording_states_no_end(tmp_path, n3dv_folder):
    path = tmp_path / "a.mkv"
    remux(n3dv_folder / "cam00.mp4", path, live="1")
    path.write_bytes(path.read_bytes()[:-50])

    assert VideoReader(path).frame_count < 6


def test_any_beginning_of_a_file_can_be_looked_at(path):
    data = path.read_bytes()
    assert not is_cut_off(path)

    for length in range(60):
        for beginning in (data[:length], data[:4] + b"\xff" * length):
            path.write_bytes(beginning)
            is_cut_off(path)


def test_an_element_may_state_any_size(tmp_path):
    path = tmp_path / "a.mkv"
    path.write_bytes(b"\x1a\x45\xdf\xa3\x01" + b"\xfe" * 7 + bytes(20))

    assert not is_cut_off(path)
