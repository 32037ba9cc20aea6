import json
from statistics import fmean

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.evaluation.camera_meter import VARIANTS
from quarc_ref.evaluation.quality import EVAL_METRIC_COLUMNS, Quality, average

_NAMES = [name for _, name, _ in EVAL_METRIC_COLUMNS]
_VALUES = st.none() | st.floats(-50, 50)


def _make_metrics(**changes):
    return dict.fromkeys(_NAMES, 1.0) | changes


@given(values=st.lists(_VALUES, min_size=1, max_size=9))
def test_a_mean_includes_only_cameras_with_the_figure(values):
    (mean,) = average({"x": value} for value in values).values()
    known_values = [value for value in values if value is not None]

    assert mean == (pytest.approx(fmean(known_values)) if known_values else None)


def test_cameras_have_equal_weight_for_any_number_of_frames():
    moving = {"a": (20.0, 22.0), "b": (None, 30.0), "c": (None, None)}
    quality = Quality({
        camera: [_make_metrics(moving_psnr=value) for value in values]
        for camera, values in moving.items()
    })  # fmt: skip

    by_camera = {name: metrics["moving_psnr"] for name, metrics in quality.by_camera().items()}
    assert by_camera == {"a": 21.0, "b": 30.0, "c": None}
    assert quality.mean()["moving_psnr"] == pytest.approx(25.5)


def test_per_frame_figures_are_means_over_the_cameras():
    quality = Quality({
        "a": [_make_metrics(psnr=30.0), _make_metrics(psnr=28.0)],
        "b": [_make_metrics(psnr=20.0), _make_metrics(psnr=24.0)],
    })  # fmt: skip

    assert quality.psnr == (25.0, 26.0)
    assert quality.ssim == (1.0, 1.0)
    assert quality.mean()["psnr"] == 25.5


def test_all_printed_means_are_equal_if_a_camera_lacks_a_frame():
    first = [_make_metrics(psnr=20.0, ssim=0.5), _make_metrics(psnr=25.0, ssim=0.6)]
    quality = Quality({"a": first, "b": [{}, _make_metrics(psnr=30.0, ssim=0.9)]})
    printed = quality.as_json((0, 1))

    mean = printed["quality"]["mean"]
    assert (printed["psnr"], printed["ssim"]) == (mean["psnr"], mean["ssim"])
    assert printed["psnr"] == pytest.approx((22.5 + 30) / 2)


def test_json_has_means_and_every_frame():
    quality = Quality(
        {"a": [_make_metrics(psnr=100.0), _make_metrics(psnr=30.0, moving_psnr=None)]}
    )
    printed = json.loads(json.dumps(quality.as_json((3, 5)), allow_nan=False))

    assert quality.count_views_at_max_psnr() == (1, 2)
    assert printed["psnr_per_frame"] == [100.0, None, 30.0]
    assert printed["psnr"] == 65
    assert printed["quality"]["mean"]["moving_psnr"] == 1
    assert printed["quality"]["cameras"][0] == {"camera": "a", **printed["quality"]["mean"]}
    assert printed["metrics"] == VARIANTS


def test_a_table_has_a_line_for_each_camera_and_one_for_the_mean():
    lines = Quality({
        "a": [_make_metrics(psnr=30.0, moving_psnr=None)],
        "b": [_make_metrics(psnr=31.0, moving_psnr=None)],
    }).as_rows()  # fmt: skip

    assert [line[:2] for line in lines] == [["a", "30.00"], ["b", "31.00"], ["mean", "30.50"]]
    assert {line[5] for line in lines} == {"-"}
    assert {len(line) for line in lines} == {len(EVAL_METRIC_COLUMNS) + 1}
