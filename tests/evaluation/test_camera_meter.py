import numpy as np
import pytest

from quarc_ref.evaluation.camera_meter import VARIANTS, CameraMeter
from quarc_ref.evaluation.color_correction import GAIN
from quarc_ref.evaluation.metrics import MAX_DECIBELS
from quarc_ref.evaluation.regions import find_background
from quarc_ref.evaluation.views import make_view

_SQUARE = (slice(4, 8), slice(4, 8))
_SIZE = (16, 20, 3)


def _wall(seed=0):
    return np.random.default_rng(seed).integers(60, 120, _SIZE).astype(np.uint8)


def _film():
    """Five pictures of a wall; only in the last one the square is bright."""
    pictures = [_wall() for _ in range(5)]
    pictures[4][_SQUARE] = 240
    return pictures


def _measure(drawn, correction=None):
    """The figures of the last of several pictures of the film, in levels of 255."""
    pictures = _film()
    more = () if correction is None else (correction,)
    meter = CameraMeter(find_background(pictures), *more)
    figures = {}
    for frame, levels in drawn.items():
        picture = (levels / 255).astype(np.float32)
        figures = meter.measure(make_view(frame, "cam00", pictures[frame], picture))
    return figures


def test_an_error_in_the_moving_region_is_seen_there_and_not_in_the_static_one():
    drawn = _film()[4].astype(float)
    drawn[_SQUARE] = 140
    figures = _measure({4: drawn})

    # 16 pixels with an error of 100 levels, of the 64 including the margin
    assert figures["moving_psnr"] == pytest.approx(-10 * np.log10((100 / 255) ** 2 / 4), abs=1e-3)
    assert figures["static_psnr"] == MAX_DECIBELS
    assert figures["moving_psnr"] < figures["psnr"] < figures["static_psnr"]


def test_a_static_scene_has_no_figure_of_the_moving_region():
    figures = _measure({0: _film()[0] + 5.0})

    assert figures["moving_psnr"] is figures["moving_cc_psnr"] is None
    assert figures["static_psnr"] == pytest.approx(figures["psnr"])


def test_without_a_background_there_are_no_regions():
    picture = _wall()
    view = make_view(0, "cam00", picture, picture.astype(np.float32) / 255)
    figures = CameraMeter(None).measure(view)

    assert {name for name, value in figures.items() if value is None} == {
        "moving_psnr", "moving_cc_psnr", "static_psnr", "static_cc_psnr",
        "flicker", "truth_flicker",
    }  # fmt: skip


def test_another_exposure_is_corrected_in_both_regions():
    figures = _measure({4: 0.8 * _film()[4]})

    assert figures["psnr"] < 25
    for name in ("cc_psnr", "moving_cc_psnr", "static_cc_psnr"):
        assert figures[name] > 80
    assert figures["cc_ssim"] > figures["ssim"]


def test_figures_after_a_correction_have_its_name():
    figures = _measure({4: 0.8 * _film()[4]}, GAIN)

    assert figures["gain_psnr"] > 80
    assert figures["moving_gain_psnr"] > 80
    assert "cc_psnr" not in figures


def test_flicker_is_the_change_of_the_static_region_between_frames():
    first, last = (picture.astype(float) for picture in _film()[3:])
    last += 3.0
    last[_SQUARE] = 0
    figures = _measure({3: first, 4: last})

    assert figures["flicker"] == pytest.approx(3, abs=1e-4)
    assert figures["truth_flicker"] == 0


def test_the_first_frame_does_not_flicker():
    assert _measure({4: _film()[4]})["flicker"] is None


def test_every_figure_states_its_metric():
    for name, reported in (("cc", "cc_*"), ("moving", "static_*"), ("flicker", "truth_flicker")):
        assert reported in VARIANTS[name]
