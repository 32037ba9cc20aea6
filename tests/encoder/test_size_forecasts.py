"""Tests of the forecasts of the size of a stream."""

import operator
import re
from dataclasses import replace

import pytest

from quarc_ref.encoder.estimate import estimate_encode
from quarc_ref.encoder.forecast import forecast
from quarc_ref.encoder.monitoring.monitor import EncodePlan
from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.settings.config import limit_gaussians
from quarc_ref.encoder.settings.presets import choose_preset
from quarc_ref.encoder.size_model import estimate_gaussians, estimate_stream_bytes
from quarc_ref.format import container
from tests.docs.pages import ROOT
from tests.encoder.toys import SMALL, make_capture, make_context
from tests.encoder.transparent_toys import make_subject_capture

FRAMES = 3


def _estimate_bytes(config):
    capture = make_capture()
    plan = EncodePlan(capture.name, FRAMES, 0, 0, len(capture.training), 1, 0, 1, 1)
    return estimate_encode(make_context(), capture.points, plan, config).byte_count


def _forecast_bytes(config):
    return forecast(make_capture(), config, FRAMES, "cpu").stream_bytes[0]


def test_frames_are_counted_by_their_chunk_type():
    settings = CanonicalSettings(keyframe_interval=6, snapshot_interval=2)

    assert settings.count_frame_kinds(9) == {
        container.CANO: 2,
        container.SNAP: 3,
        container.FRAM: 4,
    }


def test_the_upper_bound_includes_the_frames_of_demo_in_the_experiments():
    capture, frame_count, max_gaussians = make_capture(), 3, 20_000
    demo = choose_preset("demo")
    canonical = replace(demo.canonical, max_gaussians=max_gaussians, max_gaussians_from_views=0)
    config = replace(SMALL, canonical=replace(canonical, keyframe_interval=0), births=demo.births)

    one_frame, all_frames = (
        forecast(capture, config, frames, "cpu").stream_bytes[1] for frames in (1, frame_count)
    )

    assert all_frames - one_frame > (frame_count - 1) * 17.02 * 1024  # docs/experiments/paper.md


@pytest.mark.parametrize("predict", [_estimate_bytes, _forecast_bytes])
def test_keyframes_and_snapshots_make_a_stream_larger(predict):
    every_frame = [
        replace(SMALL, canonical=replace(SMALL.canonical, **{f"{kind}_interval": 1}))
        for kind in ("snapshot", "keyframe")
    ]

    without, with_snapshots, with_keyframes = map(predict, [SMALL, *every_frame])

    assert without < with_snapshots < with_keyframes


@pytest.mark.parametrize("quality", [10.0, 50.0, 90.0])
@pytest.mark.parametrize("target", [0.0, 1.5])
def test_the_estimate_of_encode_is_within_the_forecast_of_doctor(quality, target):
    config = replace(SMALL, quality=quality, target_kb_per_frame=target)
    low, high = forecast(make_capture(), config, FRAMES, "cpu").stream_bytes

    assert low <= _estimate_bytes(config) <= high


def test_a_subject_that_covers_few_pixels_needs_fewer_bytes():
    capture = make_subject_capture()
    share = sum(capture.alpha(camera, 0).mean() / 255 for camera in capture.training) / len(
        capture.training
    )
    subject, picture = (
        forecast(each, SMALL, FRAMES, "cpu").stream_bytes
        for each in (capture, make_subject_capture(has_alpha=False))
    )

    assert share < 0.9
    scales = share ** (1 / 2), share ** (1 / 4)
    assert subject == pytest.approx(tuple(map(operator.mul, picture, scales)), abs=1)


def _read_measured_streams():
    page = (ROOT / "docs" / "experiments" / "forecast.md").read_text("utf-8")
    row = r"^\| `(main|demo)`, (\d+) training .* \| (\S+) % \| (\d+) \| \d+ \| (\S+) KB \|"
    return re.findall(row, page, re.MULTILINE)


@pytest.mark.parametrize(("preset", "views", "percent", "points", "size"), _read_measured_streams())
def test_measured_streams_are_within_their_forecast(preset, views, percent, points, size):
    config = limit_gaussians(choose_preset(preset), int(views))
    gaussians = estimate_gaussians(int(points), config.canonical, float(percent) / 100)
    low, expected, high = estimate_stream_bytes(gaussians, config, FRAMES)
    measured = float(size) * 1024

    assert low <= measured <= high
    assert 1 / 3 < measured / expected < 3
