import numpy as np
import pytest

from quarc_ref.calibration.errors import CalibrationError
from quarc_ref.calibration.first_frame import read_first_frame
from quarc_ref.calibration.recordings import Recordings
from tests.calibration.rigs import LENS, make_ring


class NumberedPictures:
    """Pictures whose gray level is the number of the frame in the recording."""

    def read(self, _camera, frame):
        return np.full((LENS.height, LENS.width, 3), frame, np.uint8)


def test_a_camera_that_is_left_out_does_not_move_frame_0_of_the_capture():
    cameras = make_ring(4)
    recordings = Recordings(tuple(camera.name for camera in cameras), NumberedPictures())
    offsets = {"cam00": 2.0, "cam01": 5.0, "cam02": 2.0, "cam03": -20.0}

    all_pictures = read_first_frame(cameras, recordings, offsets).pictures
    pictures = read_first_frame(cameras[:3], recordings, offsets).pictures

    assert [picture.max() for picture in all_pictures] == [22, 25, 22, 0]
    assert [picture.max() for picture in pictures] == [0, 3, 0]


def test_videos_that_begin_with_black_frames_are_an_error_with_a_remedy():
    cameras = make_ring(4)
    recordings = Recordings(tuple(camera.name for camera in cameras), NumberedPictures())
    first_frame = read_first_frame(cameras, recordings, dict.fromkeys(recordings.names, 0.0))

    with pytest.raises(CalibrationError, match="off the beginning of all videos"):
        first_frame.triangulate_points()
