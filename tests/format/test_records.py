from dataclasses import replace

import pytest

from quarc_ref.format.records import StreamHeader
from tests.small_streams import CAMERA


@pytest.mark.parametrize(("timescale", "ticks", "fps"), [(30, 1, 30), (30_000, 1001, 29.97)])
def test_the_frame_rate_is_the_time_base_over_the_ticks(timescale, ticks, fps):
    header = StreamHeader(timescale=timescale, frame_ticks=ticks)

    assert header.frames_per_second == pytest.approx(fps, abs=1e-3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rotation": (1, 0, 0)}, "9 numbers"),
        ({"translation": (1.0,)}, "3 for its translation"),
        ({"fx": float("nan")}, "finite"),
        ({"width": 0}, "positive"),
        ({"near": -1.0}, "positive"),
    ],
)
def test_an_impossible_camera_is_rejected(changes, message):
    with pytest.raises(ValueError, match=message):
        replace(CAMERA, **changes)
