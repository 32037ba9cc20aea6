import numpy as np
import pytest

from quarc_ref.datasets.calibration import Lens
from quarc_ref.datasets.errors import UnreadableVideoError
from quarc_ref.datasets.pictures import (
    FilePictures,
    RectifiedPictures,
    SynchronizedPictures,
    VideoPictures,
)
from quarc_ref.datasets.undistortion import Rectifier
from quarc_ref.datasets.video import VideoReader
from tests.datasets import forgeries, scenes


def test_videos_and_files_give_the_same_pictures(n3dv_folder, shots, pictures, tmp_path):
    videos = VideoPictures([VideoReader(n3dv_folder / f"{shot.name}.mp4") for shot in shots])
    scenes.write_frames(tmp_path, shots, pictures)
    files = FilePictures(
        [
            [tmp_path / f"frames/{frame_number:04d}/{shot.name}.png" for frame_number in range(6)]
            for shot in shots
        ],
        [(48, 32)] * len(shots),
    )

    assert videos.lengths == files.lengths == (6, 6, 6, 6)
    assert videos.sizes == files.sizes
    for camera, frame in [(0, 0), (3, 5), (1, 2)]:
        assert np.array_equal(videos.read(camera, frame), pictures[camera][frame])
        assert np.array_equal(files.read(camera, frame), pictures[camera][frame])


def test_videos_of_different_lengths_have_their_common_frames(n3dv_folder, tmp_path, pictures):
    scenes.write_video(tmp_path / "cam01.mp4", pictures[1][:4])
    readers = [VideoReader(n3dv_folder / "cam00.mp4"), VideoReader(tmp_path / "cam01.mp4")]
    videos = VideoPictures(readers)

    assert videos.lengths == (6, 4)
    assert SynchronizedPictures(videos, (0, 0)).frame_count == 4


def test_cameras_that_started_apart_are_synchronized_by_their_offsets(n3dv_folder, pictures):
    readers = [VideoReader(n3dv_folder / f"{name}.mp4") for name in ("cam00", "cam01")]
    synchronized = SynchronizedPictures(VideoPictures(readers), (0, 2))

    assert synchronized.frame_count == 4
    assert np.array_equal(synchronized.read(0, 3), pictures[0][3])
    assert np.array_equal(synchronized.read(1, 3), pictures[1][5])


def test_a_picture_of_another_size_than_its_calibration_is_rejected(n3dv_folder):
    videos = VideoPictures([VideoReader(n3dv_folder / "cam00.mp4")])
    rectified = RectifiedPictures(videos, ["cam00"], [Rectifier(Lens(96, 64, 80, 80, 48, 32))])

    with pytest.raises(UnreadableVideoError, match=r"cam00 is 48x32.* calibration is for 96x64"):
        rectified.read(0, 0)


def test_a_file_of_another_size_than_its_calibration_is_rejected_before_it_is_decoded(tmp_path):
    truncated_png = forgeries.forge_png(11_000, 11_000)[:60]
    (tmp_path / "cam00.png").write_bytes(truncated_png)
    files = FilePictures([[tmp_path / "cam00.png"]], [(48, 32)])

    with pytest.raises(UnreadableVideoError, match=r"cam00.png is 11000x11000.* is for 48x32"):
        files.read(0, 0)


def test_rectified_pictures_are_downscaled(n3dv_folder, pictures):
    videos = VideoPictures([VideoReader(n3dv_folder / "cam00.mp4")])
    rectifier = Rectifier(Lens(48, 32, 80, 80, 48, 32), 4)
    downscaled = RectifiedPictures(videos, ["cam00"], [rectifier]).read(0, 3)

    assert np.array_equal(downscaled, rectifier.rectify(pictures[0][3]))
    assert downscaled.shape == (8, 12, 3)
