import math
from dataclasses import replace

import pytest
import torch

from quarc_ref.encoder import EncodeOptions, encode, encode_options, encode_stream
from quarc_ref.encoder.checks.first_frame_check import (
    ViewQuality,
    judge_dropped,
    judge_views,
    measure_views,
)
from tests.encoder.toys import SMALL, make_capture


def _make_views(*details):
    return [
        ViewQuality(f"cam{index:02}", 24 + detail, 24.0) for index, detail in enumerate(details)
    ]


def _list_findings(*details):
    return [(finding.kind, finding.cameras) for finding in judge_views(_make_views(*details))]


def test_views_above_their_coarse_pictures_have_no_findings():
    assert _list_findings(5, 4, 8, 3, 0.5) == []


def test_views_below_their_coarse_pictures_are_reported():
    (finding,) = judge_views(_make_views(-1.5, -2, 1, -4, -3))

    assert finding.kind == "first-frame-coarse"
    assert "only 22.0 dB" in finding.message
    assert "less than the 24.0 dB" in finding.message


def test_a_view_far_below_the_others_is_named():
    (finding,) = judge_views(_make_views(5, 4, -6, 6, 3))

    assert (finding.kind, finding.cameras) == ("first-frame-misses-cameras", ("cam02",))
    assert "cam02 (18.0 dB)" in finding.message
    assert "(median 28.0 dB)" in finding.message


def test_a_difficult_picture_is_not_blamed_on_its_camera():
    views = _make_views(5, 4, 4, 6, 3)
    views[2] = replace(views[2], psnr=18.0, coarse_psnr=14.0)

    assert list(judge_views(views)) == []


def test_exposure_is_ignored():
    picture = torch.rand(30, 40, 3, generator=torch.Generator().manual_seed(0))
    (view,) = measure_views(["a"], [(picture * 0.8, picture)], [None])

    assert view.psnr > 60


def test_a_picture_of_squares_equals_its_coarse_picture():
    squares = torch.rand(6, 20, 3, generator=torch.Generator().manual_seed(0))
    picture = squares.repeat_interleave(6, 0).repeat_interleave(6, 1)
    (flat,) = measure_views(["a"], [(picture, picture)], [None])
    (cut,) = measure_views(["a"], [(picture[:35, :119], picture[:35, :119])], [None])

    assert flat.coarse_psnr == cut.coarse_psnr == pytest.approx(100)


def test_squares_do_not_reveal_stripes():
    picture = torch.zeros(30, 40, 3)
    picture[:, ::2] = 1.0
    (view,) = measure_views(["a"], [(torch.zeros_like(picture), picture)], [None])

    assert view.coarse_psnr == pytest.approx(-10 * math.log10(0.25), abs=1e-3)


def test_only_the_weighted_pixels_are_measured():
    picture = torch.rand(36, 120, 3, generator=torch.Generator().manual_seed(0))
    image, weights = picture.roll(1, 0), torch.zeros(36, 120, 1)
    weights[:18, :60] = 1
    part = (image[:18, :60], picture[:18, :60].contiguous())
    hidden = (torch.where(weights > 0, image, 0.7), torch.where(weights > 0, picture, 0.2))

    (expected,) = measure_views(["a"], [part], [None])
    measured, *rest = measure_views("ab", [hidden, hidden], [weights, torch.zeros(36, 120, 1)])

    assert rest == []
    assert measured.psnr == pytest.approx(expected.psnr, abs=1e-3)
    assert measured.coarse_psnr > 0


def test_a_mask_does_not_make_the_coarse_picture_worse():
    picture, weights = torch.full((30, 40, 3), 0.8), torch.ones(30, 40, 1)
    weights[::3, ::2] = 0
    (view,) = measure_views(["a"], [(0 * picture, picture)], [weights])

    assert view.coarse_psnr == pytest.approx(100)


@pytest.mark.parametrize(("coded_count", "is_reported"), [(1000, False), (990, False), (980, True)])
def test_dropped_gaussians_are_reported_if_they_are_more_than_outliers(coded_count, is_reported):
    messages = [finding.message for finding in judge_dropped(1000, coded_count)]

    assert ["20 of 1,000 Gaussians" in message for message in messages] == [True] * is_reported


def test_an_encode_reports_the_gaussians_that_it_drops(tmp_path, monkeypatch):
    def keep_half(attributes, _):
        return attributes.rows(torch.arange(attributes.opacities.numel() // 2))

    monkeypatch.setattr(encode_stream, "drop_unrepresentable", keep_half)

    assert "gaussians-dropped" in [finding.kind for finding in _encode(make_capture(), tmp_path)]


def _encode(capture, tmp_path, **changes):
    findings = []
    defaults = {"iterations": 400, "densify_until_iter": 200, "max_gaussians": 400}
    canonical = replace(SMALL.canonical, **{**defaults, **changes})
    options = EncodeOptions(
        replace(SMALL, canonical=canonical),
        frames=1,
        device="cpu",
        checks=False,
        report=findings.append,
    )
    with (tmp_path / "a.quarc").open("wb") as sink:
        encode(capture, sink, options)
    return findings


def test_an_untrained_encode_is_reported(tmp_path):
    findings = _encode(make_capture(), tmp_path, iterations=1, exposure_lr=0.0)

    assert [finding.kind for finding in findings] == ["first-frame-coarse"]


def test_a_trained_encode_has_no_findings(tmp_path):
    assert _encode(make_capture(), tmp_path) == []


def test_a_resumed_stream_is_not_checked_again(tmp_path, monkeypatch):
    monkeypatch.setattr(encode_options, "check_capture", None)
    monkeypatch.setattr(encode_stream, "check_first_frame", None)
    from quarc_ref.encoder.stream_file import encode_file

    path = tmp_path / "a.quarc"
    options = EncodeOptions(SMALL, frames=1, device="cpu", checks=False)
    with pytest.raises(TypeError):
        encode_file(make_capture(), path, options)
    encode_file(make_capture(), path, replace(options, checks=True))

    assert path.stat().st_size > 0
