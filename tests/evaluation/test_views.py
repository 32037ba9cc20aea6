import numpy as np

from quarc_ref.evaluation.views import select_pixels


def test_with_a_transparent_background_pixels_of_the_truth_or_the_rendering_are_measured():
    alpha = np.array([[0, 1, 0, 0]], dtype=np.uint8)
    picture = np.zeros((1, 4, 3), dtype=np.float32)
    picture[0, 2, 1] = 0.6 / 255  # a level of 1 after rounding
    picture[0, 3] = 0.4 / 255

    assert select_pixels(picture, None, alpha).tolist() == [[False, True, True, False]]


def test_with_an_opaque_background_the_mask_selects_the_pixels():
    mask = np.array([[True, False]])

    assert select_pixels(np.zeros((1, 2, 3), dtype=np.float32), mask, None) is mask
