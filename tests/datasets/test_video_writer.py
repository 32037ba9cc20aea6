import errno
import io
from fractions import Fraction

import av
import numpy as np
import pytest

from quarc_ref.datasets.stills import read_still
from quarc_ref.datasets.video import VideoReader
from quarc_ref.datasets.video_writer import VideoFormat, build_jpeg, build_png, write_video_file


def _smooth_picture(width, height, shift=0):
    y, x = np.mgrid[:height, :width]
    return np.stack([40 + 3 * x + shift, 60 + 3 * y, 200 - 2 * x], axis=2).astype(np.uint8)


def _write(path, video_format, count=4):
    pictures = [
        _smooth_picture(video_format.width, video_format.height, 5 * shift)
        for shift in range(count)
    ]
    with path.open("wb") as sink:
        assert write_video_file(sink, iter(pictures), video_format) == count
    return pictures


@pytest.mark.parametrize("pixel_format", ["yuv444p", "yuv420p"])
def test_a_video_decodes_to_the_written_pictures(pixel_format, tmp_path):
    video_format = VideoFormat(48, 32, Fraction(30000, 1001), {"crf": "4"}, pixel_format)
    pictures = _write(tmp_path / "a.mp4", video_format)
    reader = VideoReader(tmp_path / "a.mp4")

    assert (reader.width, reader.height, reader.frame_count) == (48, 32, 4)
    assert reader.frames_per_second == pytest.approx(30000 / 1001)
    for frame, picture in enumerate(pictures):
        assert np.abs(reader.read(frame).astype(float) - picture).mean() < 2


def test_full_chroma_resolution_takes_any_size(tmp_path):
    _write(tmp_path / "odd.mp4", VideoFormat(47, 33, Fraction(30)))
    reader = VideoReader(tmp_path / "odd.mp4")

    assert (reader.width, reader.height) == (47, 33)


def test_a_video_states_its_color_space(tmp_path):
    _write(tmp_path / "a.mp4", VideoFormat(48, 32, Fraction(30)))
    with av.open(str(tmp_path / "a.mp4")) as container:
        context = container.streams.video[0].codec_context
        color_tags = (context.colorspace, context.color_range, context.pix_fmt)

    assert color_tags == (av.video.reformatter.Colorspace.ITU601.value, 1, "yuv444p")


def test_a_failing_encoder_is_a_system_error(tmp_path):
    with pytest.raises(OSError, match=r"H\.264"):
        _write(tmp_path / "odd.mp4", VideoFormat(47, 33, Fraction(30), {}, "yuv420p"))


@pytest.mark.parametrize("capacity", [0, 100, 3000])
def test_the_error_of_a_full_disk_is_kept(capacity):
    class FullDisk(io.BytesIO):
        def write(self, data):
            if self.tell() + len(data) > capacity:
                raise OSError(errno.ENOSPC, "No space left on device")
            return super().write(data)

    noise = np.random.default_rng(0).integers(0, 256, (48, 64, 3), dtype=np.uint8)
    with pytest.raises(OSError, match="No space left on device"):
        write_video_file(FullDisk(), [noise] * 8, VideoFormat(64, 48, Fraction(30)))


def test_a_png_equals_the_picture(tmp_path):
    picture = np.random.default_rng(1).integers(0, 256, (13, 7, 3), dtype=np.uint8)
    (tmp_path / "a.png").write_bytes(build_png(picture))

    assert np.array_equal(read_still(tmp_path / "a.png"), picture)


def test_a_jpeg_looks_like_the_picture(tmp_path):
    picture = _smooth_picture(45, 31)
    (tmp_path / "a.jpg").write_bytes(build_jpeg(picture))
    decoded = read_still(tmp_path / "a.jpg")

    assert np.abs(decoded.astype(float) - picture).mean() < 1.5
