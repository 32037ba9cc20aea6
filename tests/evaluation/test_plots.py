import io
import math

import matplotlib.image
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quarc_ref.evaluation import plots
from quarc_ref.evaluation.plots import (
    Curve,
    encode_picture,
    plot_bytes_by_kind,
    plot_frames,
    plot_number_groups,
)
from quarc_ref.format.records import StreamHeader
from quarc_ref.inspection.inspect_stream import inspect_stream
from quarc_ref.inspection.stream_summary import KINDS
from tests.small_streams import make_stream


def _read_png(png):
    return matplotlib.image.imread(io.BytesIO(png))[..., :3]


@given(arrays(np.uint8, (3, 5, 3)))
def test_a_picture_survives_a_round_trip(levels):
    picture = levels.astype(np.float32) / np.float32(255)

    assert np.array_equal(np.round(_read_png(encode_picture(picture)) * 255), levels)


@given(st.floats(-1, 2, width=32))
def test_a_value_is_rounded_to_the_nearest_level(number):
    picture = np.full((1, 1, 3), number, dtype=np.float32)

    stored = _read_png(encode_picture(picture))[0, 0, 0]
    assert abs(stored - min(max(number, 0), 1)) <= 0.5 / 255 + 1e-6


@pytest.mark.parametrize("frame_count", [1, 2, 5])
def test_streams_of_any_length_can_be_plotted(frame_count):
    data, _ = make_stream(frame_count=frame_count)
    summary = inspect_stream(data)

    for plot in (
        plot_frames(summary, Curve(range(frame_count), [30.0] * frame_count)),
        plot_bytes_by_kind(summary),
    ):
        picture = _read_png(plot)
        assert picture.shape[1] == 880
        assert np.unique((255 * picture).astype(np.int64) @ (1, 256, 65536)).size > 10


def test_other_values_give_another_plot():
    summary = inspect_stream(make_stream()[0])

    assert plot_frames(summary, Curve(range(4), [30, 31, 32, 33])) != plot_frames(
        summary, Curve(range(4), [30, 31, 32, 30])
    )


def test_bars_have_the_sizes_of_the_stream(monkeypatch):
    monkeypatch.setattr(plots, "_encode_png", lambda figure: figure)
    header = StreamHeader(seed=3, updates=True)
    summary = inspect_stream(make_stream(header, frame_count=5)[0])
    _, frame_axes = plot_frames(summary, Curve(range(5), [30.0] * 5)).axes
    (kind_axes,) = plot_bytes_by_kind(summary).axes

    for index, frame in enumerate(summary.frames[1:], start=1):
        top = 0.0
        for kind, bars in zip(("motion", "updates", "births"), frame_axes.containers, strict=False):
            assert bars[index].get_y() == pytest.approx(top)
            assert bars[index].get_height() == pytest.approx(frame.coded_bytes[kind] / 1024)
            top += bars[index].get_height()
        overhead_bar = frame_axes.containers[3][index]
        assert overhead_bar.get_y() == pytest.approx(top)
        assert top + overhead_bar.get_height() == pytest.approx(frame.chunk_bytes / 1024)
    sizes = [[bar.get_height() * 1024 for bar in bars] for bars in kind_axes.containers]
    coded, estimate = summary.coded_bytes(), summary.estimate_bytes()
    assert sizes[0] == pytest.approx([coded[kind] for kind in (*KINDS, "overhead")])
    assert sizes[1] == pytest.approx([estimate[kind] for kind in KINDS])


def test_a_frame_without_any_error_can_be_plotted():
    summary = inspect_stream(make_stream()[0])

    assert _read_png(plot_frames(summary, Curve(range(4), [30, math.inf, 32, 33]))).size > 0


def test_the_scatter_of_seeds_is_shown_even_if_a_group_has_no_number():
    panels = {"dB": {"a": [30.0, 31.0], "b": [29.0]}, "moving": {"a": [20.0, 20.5], "b": []}}
    wider = {"dB": {"a": [28.0, 33.0], "b": [29.0]}, "moving": panels["moving"]}

    assert _read_png(plot_number_groups(panels)).shape[1] == 880
    assert plot_number_groups(panels) != plot_number_groups(wider)
