from dataclasses import replace

import numpy as np

from quarc_ref.decoder import dequantize
from quarc_ref.rendering.magnification import UNMAGNIFIED
from quarc_ref.rendering.pictures import render_picture
from quarc_ref.viewing.draw_frames import BLACK, draw_picture
from tests.small_streams import CAMERA, make_stream


def test_a_picture_equals_that_of_evaluation_up_to_rounding():
    splats = dequantize(make_stream()[1][1].scene)
    picture = draw_picture(splats, CAMERA, UNMAGNIFIED)

    expected = np.clip(render_picture(splats, CAMERA), 0, 1)
    assert picture.dtype == np.uint8
    assert np.abs(picture / 255 - expected).max() <= 0.5 / 255 + 1e-6
    assert picture.std() > 1


def test_every_background_shows_through_by_the_same_alpha():
    splats = dequantize(make_stream()[1][1].scene)
    splats = replace(splats, log_scales=splats.log_scales - 4)
    on_black, on_white, on_orange, clear = (
        draw_picture(splats, CAMERA, UNMAGNIFIED, background).astype(float)
        for background in (BLACK, (1.0, 1.0, 1.0), (1.0, 0.5, 0.0), None)
    )
    alpha = clear[..., 3:] / 255
    assert clear.shape == (*on_black.shape[:2], 4)
    assert alpha.min() < 0.2
    assert alpha.max() > 0.8
    is_in_range = (clear[..., :3] > 0) & (clear[..., :3] < 255)
    assert is_in_range.any()
    for picture, color in ((on_black, 0), (on_white, 255), (on_orange, (255, 127.5, 0))):
        expected = clear[..., :3] * alpha + np.array(color) * (1 - alpha)
        assert np.abs(picture - expected)[is_in_range].max() <= 2
        assert np.abs(picture - color)[clear[..., 3] == 0].max(initial=0) <= 1
