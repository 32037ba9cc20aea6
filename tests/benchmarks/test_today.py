import pytest

import today


@pytest.mark.parametrize("plot", today.PLOTS, ids=lambda plot: plot.name)
def test_the_plots_show_the_figures(plot):
    svg = today.draw_plot(plot)

    assert svg.count(b"<path") > 20
    assert svg == today.draw_plot(plot)  # the plot is deterministic


def test_a_missing_value_is_left_out(tmp_path):
    (tmp_path / "gap.csv").write_text("x,a,b\n0,1,2\n1,,3\n2,4,5\n")

    assert today.draw_plot(today.Plot("gap", "x", "y"), tmp_path).startswith(b"<?xml")
