import csv
import io
from dataclasses import replace
from pathlib import Path
from statistics import stdev
from types import SimpleNamespace

import pytest

from quarc_ref.evaluation.comparison import page
from quarc_ref.evaluation.comparison.entries import EntryInfo, Label
from quarc_ref.evaluation.comparison.measure import Comparison, MeasuredEntry
from quarc_ref.evaluation.comparison.summary import summarize
from quarc_ref.evaluation.comparison.tables import (
    format_delta_rows,
    format_point_rows,
    format_points_csv,
    format_views_csv,
    list_point_headings,
    list_remarks,
)
from quarc_ref.evaluation.plots import Curve
from quarc_ref.evaluation.protocol import SharedProtocol
from quarc_ref.evaluation.quality import Quality

_FRAMES = (3, 4)


def _make_entry(method, point, psnr, byte_count):
    """An entry of two cameras with this PSNR at the first frame, and 2 dB more at the second."""
    views = [{"psnr": psnr, "ssim": psnr / 100}, {"psnr": psnr + 2, "ssim": psnr / 100}]
    quality = Quality({"cam00": views, "cam01": views})
    return MeasuredEntry(Label(method, point), EntryInfo("stream", _FRAMES, byte_count), quality)


def _make_comparison(*entries):
    protocol = SharedProtocol(None, (64, 48), "numba", {"quarc-ref": "1"})
    return Comparison(
        list(entries), _FRAMES, ("cam00", "cam01"), "the truth", 30.0, [], {"psnr": "dB"}, protocol
    )


def test_runs_of_a_point_are_summarized_by_mean_and_deviation():
    summary = summarize(
        _make_comparison(*(_make_entry("a", "x", psnr, 2048) for psnr in (30.0, 31.0, 35.0)))
    )
    (point,) = summary.points

    assert point.run_count == 3
    assert point.metrics["psnr"].mean == pytest.approx(33)
    assert point.metrics["psnr"].deviation == pytest.approx(stdev([31, 32, 36]))
    assert point.kilobytes_per_frame.mean == 1
    assert point.megabits_per_second == pytest.approx(1024 * 8 * 30 / 1e6)
    assert format_point_rows(summary)[0][3] == "33.00 ± 2.65"


def test_pairs_are_of_the_same_camera_and_frame():
    summary = summarize(
        _make_comparison(_make_entry("a", "a", 30.0, 10), _make_entry("b", "b", 29.5, 10))
    )
    first, second = summary.points

    assert first.paired_difference is None
    assert second.paired_difference.psnr.mean == pytest.approx(-0.5)
    assert second.paired_difference.psnr.deviation == pytest.approx(0)
    assert (second.paired_difference.better_share, second.paired_difference.pair_count) == (0, 4)
    assert format_point_rows(summary)[1][-2:] == ["-0.50 ± 0.00", "0% of 4"]


@pytest.mark.parametrize(("psnr", "share"), [(30.004, 0.5), (29.996, 0.5), (30.006, 1), (29.9, 0)])
def test_a_difference_that_is_printed_as_zero_counts_as_half_a_pair(psnr, share):
    first, second = (
        _make_entry(name, name, value, 10) for name, value in (("a", 30.0), ("b", psnr))
    )
    point = summarize(_make_comparison(first, second)).points[1]

    assert point.paired_difference.better_share == share


def test_a_small_loss_is_printed_as_zero_without_a_minus():
    comparison = _make_comparison(
        _make_entry("a", "a", 30.0, 10), _make_entry("b", "b", 29.999, 10)
    )

    assert format_point_rows(summarize(comparison))[1][-2] == "+0.00 ± 0.00"


def test_views_equal_to_the_truth_count_as_100_db_and_are_named():
    comparison = _make_comparison(_make_entry("a", "a", 98.0, 10), _make_entry("b", "b", 30.0, 10))

    assert summarize(comparison).points[1].paired_difference.pair_count == 4
    assert list_remarks(comparison) == [
        "a equals the truth in 2 of 4 views; each of them counts as 100 dB in means and differences"
    ]


def test_runs_with_the_same_results_are_remarked():
    runs = [_make_entry("a", "x", psnr, 10) for psnr in (30.0, 31.0, 30.0, 30.0)]
    other_points = [_make_entry("a", "y", 30.0, 10), _make_entry("b", "x", 30.0, 10)]

    assert list_remarks(_make_comparison(*runs[:2], *other_points)) == []
    assert list_remarks(_make_comparison(*runs, *other_points)) == [
        "runs of a@x have the same results, so their deviation is too small: runs need different "
        "seeds"
    ]


def test_points_of_unknown_size_are_missing_from_a_curve_with_a_remark():
    entries = [_make_entry(method, point, 30.0, None) for method in "ab" for point in "xy"]
    summary = summarize(_make_comparison(*entries))

    assert summary.points[1].kilobytes_per_frame is None
    assert "the reference has 0 points of known size" in format_delta_rows(summary)[0][-1]
    assert format_point_rows(summary)[1][list_point_headings(summary).index("bytes")] == "-"


def test_methods_with_other_numbers_of_frames_are_not_compared_by_bjontegaard():
    entries = [
        _make_entry(method, str(rate), 30 + step, rate)
        for method in ("ours", "theirs")
        for step, rate in enumerate((1000, 2000, 4000, 8000))
    ]
    entries[-1] = replace(entries[-1], info=EntryInfo("stream", (3, 4, 5), 8000))
    (delta,) = summarize(_make_comparison(*entries)).deltas

    assert delta.psnr.rate is delta.psnr.quality is None
    assert delta.psnr.remark.startswith("the entries have 2 and 3 frames")


def test_methods_with_four_rates_are_compared_by_bjontegaard():
    rates = (1000, 2000, 4000, 8000)
    reference_entries = [
        _make_entry("ours", str(rate), 30 + step, rate) for step, rate in enumerate(rates)
    ]
    other_entries = [
        _make_entry("theirs", str(rate), 30 + step, 2 * rate) for step, rate in enumerate(rates)
    ]
    summary = summarize(_make_comparison(*reference_entries, *other_entries))
    (delta,) = summary.deltas

    assert summary.reference == "ours"
    assert delta.psnr.rate == pytest.approx(100)
    assert delta.ssim.rate == pytest.approx(100)
    assert format_delta_rows(summary)[0][:2] == ["theirs", "+100.0 %"]


def test_a_method_with_one_point_beside_a_curve_is_reported():
    rates = (1000, 2000, 4000, 8000)
    curve = [_make_entry("ours", str(rate), 30 + step, rate) for step, rate in enumerate(rates)]
    summary = summarize(_make_comparison(*curve, _make_entry("theirs", "a", 31.0, 10)))

    assert format_delta_rows(summary)[0][::4] == [
        "theirs",
        "the method has 1 point of known size; 4 are needed",
    ]


def test_csv_has_a_line_for_each_point_and_view():
    comparison = _make_comparison(
        _make_entry("a", "x", 30.0, 10), _make_entry("a", "x", 31.0, None)
    )
    points = list(csv.DictReader(io.StringIO(format_points_csv(summarize(comparison)).decode())))
    views = list(csv.DictReader(io.StringIO(format_views_csv(comparison).decode())))

    assert [(row["runs"], row["psnr"]) for row in points] == [("2", "31.5")]
    assert len(views) == 8
    assert views[-1] == {
        "method": "a", "point": "x", "run": "1", "camera": "cam01", "frame": "4",
        "psnr": "33.0", "ssim": "0.31",
    }  # fmt: skip


def test_csv_has_a_mark_for_what_is_no_valid_utf_8_in_a_name():
    comparison = _make_comparison(_make_entry("a\udcffb", "x", 30.0, 10))

    assert b"\na?b,x,stream," in format_points_csv(summarize(comparison))
    assert b"\na?b,x,0,cam00," in format_views_csv(comparison)


@pytest.mark.parametrize(
    ("name", "cell"), [("=A1", "'=A1"), ("+A1", "'+A1"), ("-A1", "'-A1"), ("@A1", "'@A1"),
                       ("\t=A1", "?=A1"), ("a\r=A1", "a?=A1")]
)  # fmt: skip
def test_a_name_is_no_formula_of_a_spreadsheet(name, cell):
    comparison = _make_comparison(_make_entry("a", "x", -30.0, 10))
    (entry,) = comparison.measured_entries
    quality = Quality({name: entry.quality.per_camera["cam00"]})
    renamed = replace(entry, label=Label(name, name), quality=quality)
    changed = replace(comparison, measured_entries=[renamed])
    (point,) = csv.DictReader(io.StringIO(format_points_csv(summarize(changed)).decode()))
    view, _ = csv.DictReader(io.StringIO(format_views_csv(changed).decode()))

    assert (point["method"], point["point"], point["psnr"]) == (cell, cell, "-29.0")
    assert (view["method"], view["camera"], view["psnr"]) == (cell, cell, "-30.0")


def test_csv_has_the_differences_from_the_first_point():
    comparison = _make_comparison(
        _make_entry("a", "x", 30.0, 4096), _make_entry("b", "y", 31.0, 1024)
    )
    first, second = csv.DictReader(io.StringIO(format_points_csv(summarize(comparison)).decode()))
    names = ("psnr_to_first", "psnr_to_first_deviation", "better_than_first", "kb_per_frame")

    assert [first[name] for name in names] == ["", "", "", "2.0"]
    assert [second[name] for name in names] == ["1.0", "0.0", "1.0", "0.5"]


def test_the_curves_of_the_page_go_from_low_to_high_rates(monkeypatch):
    panels = {}
    monkeypatch.setattr(page, "plot_rates", lambda curves, _: panels.update(curves) or b"")
    rates_and_psnr = ((4096, 33.0), (1024, 30.0), (2048, 31.0))
    comparison = _make_comparison(
        *(_make_entry("a", str(rate), psnr, rate) for rate, psnr in rates_and_psnr)
    )
    folder = SimpleNamespace(write=lambda name, _: Path(name))
    page.write_comparison(comparison, summarize(comparison), folder)

    assert panels["PSNR (dB)"]["a"] == Curve((0.5, 1, 2), (31, 32, 34), (None,) * 3)
