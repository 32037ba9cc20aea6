import numpy as np
import pytest

from quarc_ref.datasets.video import VideoReader
from quarc_ref.synth.write_video import write_video


def _smooth_picture(options, shift):
    y, x = np.mgrid[: options.height, : options.width]
    channels = (40 + 3 * x + shift, 60 + 3 * y, 200 - 2 * x)
    return np.stack(channels, axis=2).astype(np.uint8)


def test_a_video_decodes_to_the_written_colors(options, tmp_path):
    pictures = [_smooth_picture(options, 5 * frame) for frame in range(3)]
    write_video(tmp_path / "smooth.mp4", pictures, options)
    reader = VideoReader(tmp_path / "smooth.mp4")

    for frame, picture in enumerate(pictures):
        difference = reader.read(frame).astype(float) - picture
        assert np.abs(difference).mean() < 3
        assert np.abs(difference.mean(axis=(0, 1))).max() < 2


def test_a_missing_folder_is_an_error_that_names_the_file(options, tmp_path):
    with pytest.raises(OSError, match="no_such"):
        write_video(tmp_path / "no_such" / "cam.mp4", [_smooth_picture(options, 0)], options)
