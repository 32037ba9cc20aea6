import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.evaluation.camera_meter import VARIANTS, CameraMeter
from quarc_ref.evaluation.color_correction import GAIN_CORRECTION
from quarc_ref.evaluation.metrics import MAX_DECIBELS
from quarc_ref.evaluation.regions import find_background
from quarc_ref.evaluation.views import make_view

_SQUARE = (slice(4, 8), slice(4, 8))
_SIZE = (16, 20, 3)


def _make_wall(seed=0):
    return np.random.default_rng(seed).integers(60, 120, _SIZE).astype(np.uint8)


def _make_video():
    """Five pictures of a wall; the last picture contains a bright square."""
    pictures = [_make_wall() for _ in range(5)]
    pictures[4][_SQUARE] = 240
    return pictures


def _measure_last(renderings, correction=None):
    """The metrics of the last rendering, after all renderings (8-bit levels) were measured."""
    pictures = _make_video()
    corrections = () if correction is None else (correction,)
    meter = CameraMeter(find_background(pictures), *corrections)
    metrics = {}
    for frame, levels in renderings.items():
        picture = (levels / 255).astype(np.float32)
        metrics = meter.measure(make_view(frame, "cam00", pictures[frame], picture))
    return metrics


def test_an_error_in_the_moving_region_is_seen_there_and_not_in_the_static_one():
    rendering = _make_video()[4].astype(float)
    rendering[_SQUARE] = 140
    metrics = _measure_last({4: rendering})

    # 16 pixels with an error of 100 levels, of the 64 including the margin
    assert metrics["moving_psnr"] == pytest.approx(-10 * np.log10((100 / 255) ** 2 / 4), abs=1e-3)
    assert metrics["static_psnr"] == MAX_DECIBELS
    assert metrics["moving_psnr"] < metrics["psnr"] < metrics["static_psnr"]


def test_a_static_scene_has_no_figure_of_the_moving_region():
    metrics = _measure_last({0: _make_video()[0] + 5.0})

    assert metrics["moving_psnr"] is metrics["moving_cc_psnr"] is None
    assert metrics["static_psnr"] == pytest.approx(metrics["psnr"])


def test_without_a_background_there_are_no_regions():
    picture = _make_wall()
    view = make_view(0, "cam00", picture, picture.astype(np.float32) / 255)
    metrics = CameraMeter(None).measure(view)

    assert {name for name, value in metrics.items() if value is None} == {
        "moving_psnr", "moving_cc_psnr", "static_psnr", "static_cc_psnr",
        "flicker", "truth_flicker",
    }  # fmt: skip


def test_another_exposure_is_corrected_in_both_regions():
    metrics = _measure_last({4: 0.8 * _make_video()[4]})

    assert metrics["psnr"] < 25
    for name in ("cc_psnr", "moving_cc_psnr", "static_cc_psnr"):
        assert metrics[name] > 80
    assert metrics["cc_ssim"] > metrics["ssim"]


def test_figures_after_a_correction_have_its_name():
    metrics = _measure_last({4: 0.8 * _make_video()[4]}, GAIN_CORRECTION)

    assert metrics["gain_psnr"] > 80
    assert metrics["moving_gain_psnr"] > 80
    assert "cc_psnr" not in metrics


def test_flicker_is_the_change_of_the_static_region_between_frames():
    first, last = (picture.astype(float) for picture in _make_video()[3:])
    last += 3.0
    last[_SQUARE] = 0
    metrics = _measure_last({3: first, 4: last})

    assert metrics["flicker"] == pytest.approx(3, abs=1e-4)
    assert metrics["truth_flicker"] == 0


def test_frames_after_a_gap_do_not_flicker():
    video = _make_video()

    assert _measure_last({2: video[2], 4: video[4]})["flicker"] is None
    assert _measure_last({3: video[3], 4: video[4]})["flicker"] is not None


def test_the_first_frame_does_not_flicker():
    assert _measure_last({4: _make_video()[4]})["flicker"] is None


def test_every_figure_states_its_metric():
    for name, metric_name in (("cc", "cc_*"), ("moving", "static_*"), ("flicker", "truth_flicker")):
        assert metric_name in VARIANTS[name]


@given(kept=st.integers(9, 19), seed=st.integers(0, 1 << 30))
def test_masked_pixels_count_as_little_as_pixels_outside_the_picture(kept, seed):
    rng = np.random.default_rng(seed)
    pictures = np.stack(_make_video())
    pictures[:, :, kept:] = rng.integers(0, 256, pictures[:, :, kept:].shape)
    renderings = rng.normal(0.9 * pictures, 5) / 255
    mask = np.arange(_SIZE[1]) < np.full((_SIZE[0], 1), kept)
    masked_meter = CameraMeter(find_background(pictures))
    cropped_meter = CameraMeter(find_background(pictures[:, :, :kept]))
    for frame in (3, 4):
        picture, rendering = pictures[frame], renderings[frame].astype(np.float32)
        masked = masked_meter.measure(make_view(frame, "cam00", picture, rendering, mask))
        cropped = cropped_meter.measure(
            make_view(frame, "cam00", picture[:, :kept], rendering[:, :kept])
        )

    assert masked["moving_psnr"] is not None
    for name in masked.keys() - {"ssim", "cc_ssim"}:  # windows reach beyond the kept pixels
        assert masked[name] == pytest.approx(cropped[name], rel=1e-5)


def test_a_completely_masked_picture_is_measured_without_its_mask():
    wall, rendering = _make_wall(), (_make_wall(1) / 255).astype(np.float32)
    views = [
        make_view(0, "cam00", wall, rendering, mask)
        for mask in (None, np.zeros(_SIZE[:2], dtype=bool))
    ]

    assert views[1].psnr == views[0].psnr < MAX_DECIBELS
    assert views[1].ssim == views[0].ssim
    assert "measured without its mask" in VARIANTS["mask"]
