from dataclasses import replace

import cv2
import numpy as np
import pytest

from quarc_ref.streams import BytesSource
from quarc_ref.viewing.poster import draw_poster
from tests.small_streams import CAMERA, make_stream


@pytest.mark.parametrize(
    ("size", "expected"),
    [((64, 48), (64, 48)), ((1920, 1080), (960, 540)), ((1080, 1920), (540, 960))],
)
def test_a_poster_has_at_most_960_pixels_on_each_side(size, expected):
    camera = replace(CAMERA, width=size[0], height=size[1])
    poster = draw_poster(BytesSource(make_stream()[0]), camera)
    picture = cv2.imdecode(np.frombuffer(poster, np.uint8), cv2.IMREAD_COLOR)

    assert picture.shape == (expected[1], expected[0], 3)


def test_pictures_too_narrow_for_a_poster_have_none():
    camera = replace(CAMERA, width=1, height=2000)

    assert draw_poster(BytesSource(make_stream()[0]), camera) is None
