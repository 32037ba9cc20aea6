import io

import matplotlib.image
import numpy as np
import pytest

from quarc_ref.evaluation import plots
from quarc_ref.evaluation.plots import (
    Curve,
    plot_coders,
    plot_curves,
    plot_rate_distortion,
    plot_rates,
)

PANELS = {"motion, KB": {"file": 1.0, "float32": 400.0}, "births, KB": {"file": 0.5}}
POINTS = [(2.0, 30.0, ""), (1.0, 28.0, "rd_lambda=2"), (3.0, 30.2, "rd_lambda=0.5")]
HULL = [(1.0, 28.0), (2.0, 30.0), (3.0, 30.2)]


def _count_colors(png):
    picture = matplotlib.image.imread(io.BytesIO(png))[..., :3]
    return np.unique((255 * picture).astype(np.int64) @ (1, 256, 65536)).size


def test_coders_and_points_are_plotted():
    assert _count_colors(plot_coders(PANELS)) > 10
    assert _count_colors(plot_rate_distortion(POINTS, HULL)) > 10


def test_a_default_alone_can_be_plotted():
    assert _count_colors(plot_rate_distortion(POINTS[:1], [POINTS[0][:2]])) > 10


def test_other_sizes_give_another_plot():
    changed_panels = {**PANELS, "births, KB": {"file": 0.6}}

    assert plot_coders(changed_panels) != plot_coders(PANELS)


def test_the_default_is_marked():
    reordered = [POINTS[1], POINTS[0], POINTS[2]]

    assert plot_rate_distortion(reordered, HULL) != plot_rate_distortion(POINTS, HULL)


def test_panels_share_one_axis():
    panels = {
        "dB": {"gate": Curve([0, 1, 2], [30, 31, 30.5]), "no gate": Curve([0, 1], [30, 32])},
        "births": {"gate": Curve([0, 1, 2], [0, 5, 9])},
    }
    single_panel = {"dB": {"": Curve([0.5, 1, 2], [30, 31, 30])}}

    assert _count_colors(plot_curves(panels, "frame")) > 10
    assert plot_curves(single_panel, "step") != plot_curves(single_panel, "step", is_log2=True)


@pytest.mark.parametrize("plot", [plot_curves, plot_rates])
def test_all_curves_of_a_plot_look_different(monkeypatch, plot):
    monkeypatch.setattr(plots, "_encode_png", lambda figure: figure)
    curves = {f"method@{point}": Curve([0, 1], [30, 30 + point]) for point in range(16)}

    (axes,) = plot({"dB": curves}, "frame").axes

    assert len({(line.get_color(), line.get_linestyle()) for line in axes.lines}) == 16


def test_points_with_a_deviation_have_error_bars(monkeypatch):
    monkeypatch.setattr(plots, "_encode_png", lambda figure: figure)

    curve = Curve([1, 2, 3], [30, 31, 32], [0.5, None, 0.25])
    (axes,) = plot_rates({"dB": {"a": curve}}, "KB").axes

    (bars,) = axes.collections
    segments = [segment.tolist() for segment in bars.get_segments() if segment.size]
    assert segments == [[[1, 29.5], [1, 30.5]], [[3, 31.75], [3, 32.25]]]


@pytest.mark.parametrize(
    "names", [("_a", "_b"), ("a$x_$", "b"), (r"$\frac$", r"\$"), ("a\udcff", "b\x1b\n")]
)
@pytest.mark.filterwarnings("error")
def test_any_names_can_be_labels_of_curves(names):
    panels = {"PSNR": {name: Curve([1, 2], [3, 4 + i]) for i, name in enumerate(names)}}
    other_panels = {"PSNR": dict(zip(("c", "d"), panels["PSNR"].values(), strict=True))}

    for plot in (plot_rates, plot_curves):
        assert plot(panels, "frame") != plot(other_panels, "frame")
