import numpy as np

from quarc_ref.decoder import dequantize
from quarc_ref.rendering.magnification import UNMAGNIFIED
from quarc_ref.rendering.pictures import render_picture
from quarc_ref.streams import BytesSource
from quarc_ref.viewing.draw_frames import draw_frames
from tests.small_streams import CAMERA, make_stream


def test_pictures_equal_those_of_evaluation_up_to_rounding():
    data, states = make_stream()
    pictures = dict(draw_frames(BytesSource(data), CAMERA, UNMAGNIFIED, 1, 3))

    assert list(pictures) == [1, 2]
    for frame, picture in pictures.items():
        expected = np.clip(render_picture(dequantize(states[frame].scene), CAMERA), 0, 1)
        assert picture.dtype == np.uint8
        assert np.abs(picture / 255 - expected).max() <= 0.5 / 255 + 1e-6
        assert picture.std() > 1
