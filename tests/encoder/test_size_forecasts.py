"""Tests that forecasts of the size of a stream count its keyframes and snapshots."""

from dataclasses import replace

import pytest

from quarc_ref.encoder.estimate import estimate_encode
from quarc_ref.encoder.forecast import forecast
from quarc_ref.encoder.monitoring.monitor import EncodePlan
from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.format import container
from tests.encoder.toys import SMALL, make_capture, make_context

FRAMES = 3


def _estimate_bytes(config):
    capture = make_capture()
    plan = EncodePlan(capture.name, FRAMES, 0, 0, len(capture.training), 1, 1, 1)
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


@pytest.mark.parametrize("predict", [_estimate_bytes, _forecast_bytes])
def test_keyframes_and_snapshots_make_a_stream_larger(predict):
    every_frame = [
        replace(SMALL, canonical=replace(SMALL.canonical, **{f"{kind}_interval": 1}))
        for kind in ("snapshot", "keyframe")
    ]

    without, with_snapshots, with_keyframes = map(predict, [SMALL, *every_frame])

    assert without < with_snapshots < with_keyframes
