import pytest

import today


@pytest.mark.parametrize("plot", today.PLOTS, ids=lambda plot: plot.name)
def test_the_plots_show_the_figures(plot):
    drawn = today.draw_plot(plot)

    assert drawn.count(b"<path") > 20
    assert drawn == today.draw_plot(plot)  # only the figures decide


def test_a_missing_value_is_left_out(tmp_path):
    (tmp_path / "gap.csv").write_text("x,a,b\n0,1,2\n1,,3\n2,4,5\n")

    assert today.draw_plot(today.Plot("gap", "x", "y"), tmp_path).startswith(b"<?xml")
