from dataclasses import replace

import pytest

from quarc_ref.inspection.inspect_stream import inspect_stream
from quarc_ref.inspection.stream_summary import KINDS
from rate.claims import (
    Claim,
    amortize,
    amortize_estimate,
    amortize_file,
    list_canonical_claims,
    list_fourdgs_claims,
    list_motion_claims,
    list_paper_claims,
)
from tests.small_streams import make_stream


@pytest.fixture(scope="module")
def data_and_summary():
    data, _ = make_stream(frame_count=4)
    return data, inspect_stream(data)


def _change_frame(summary, index, **fields):
    frames = list(summary.frames)
    frames[index] = replace(frames[index], **fields)
    return replace(summary, frames=tuple(frames))


@pytest.mark.parametrize(
    ("value", "is_maximum", "holds"),
    [
        (0.4, True, True),
        (0.5, True, True),
        (0.6, True, False),
        (0.4, False, False),
        (0.5, False, True),
        (0.6, False, True),
        (None, True, None),
        (None, False, None),
    ],
)
def test_a_claim_holds_up_to_its_limit(value, is_maximum, holds):
    assert Claim("some", value, 0.5, is_maximum).holds is holds


def test_a_canonical_frame_serves_300_frames():
    assert amortize(3000, [4, 6]) == 15
    assert amortize(3000, []) == 10


def test_the_whole_file_is_amortized(data_and_summary):
    data, summary = data_and_summary
    moved_bytes = [frame.chunk_bytes for frame in summary.frames[1:]]

    expected = (len(data) - sum(moved_bytes)) / 300 + sum(moved_bytes) / 3
    assert amortize_file(summary) == pytest.approx(expected)


def test_the_estimate_leaves_out_what_the_paper_leaves_out(data_and_summary):
    _, summary = data_and_summary
    estimates = [frame.estimate_bytes for frame in summary.frames]

    moved_bytes = sum(estimate["motion"] + estimate["births"] for estimate in estimates) / 3
    expected = estimates[0]["canonical"] / 300 + moved_bytes
    assert amortize_estimate(summary) == pytest.approx(expected)


def test_motion_and_births_are_compared_over_all_frames(data_and_summary):
    _, summary = data_and_summary
    motion_claim, _, births_claim = list_motion_claims(summary)

    coded_bytes = summary.coded_bytes()
    estimate = sum(frame.estimate_bytes["motion"] for frame in summary.frames)
    assert motion_claim.value == pytest.approx(coded_bytes["motion"] / estimate)
    assert births_claim.value == coded_bytes["births"] / sum(
        frame.births for frame in summary.frames
    )


def test_one_bad_frame_is_the_worst(data_and_summary):
    _, summary = data_and_summary
    sizes = dict.fromkeys(KINDS, 0) | {"motion": 9000}
    estimate = dict.fromkeys(KINDS, 0.0) | {"motion": 300.0}

    changed_summary = _change_frame(summary, 2, coded_bytes=sizes, estimate_bytes=estimate)
    assert list_motion_claims(changed_summary)[1].value == 30
    assert list_motion_claims(changed_summary)[1].holds is False


def test_static_frames_have_no_ratio(data_and_summary):
    _, summary = data_and_summary
    estimate = {"canonical": 0.0, "motion": 0.0, "births": 0.0}
    static_summary = summary
    for index in (1, 2, 3):
        static_summary = _change_frame(static_summary, index, estimate_bytes=estimate)

    assert list_motion_claims(static_summary)[0].value is None
    assert list_motion_claims(static_summary)[1].value is None


def test_a_stream_of_one_frame_makes_no_claim_about_motion():
    summary = inspect_stream(make_stream(frame_count=1)[0])

    assert [claim.value for claim in list_motion_claims(summary)] == [None, None, None]


def test_a_canonical_frame_is_compared_in_bytes_and_in_quality():
    size_claim, quality_claim = list_canonical_claims(70, 30.0, "SPZ v4", (100, 30.5), 0.8)

    assert (size_claim.value, size_claim.holds) == (0.7, True)
    assert (quality_claim.value, quality_claim.holds) == (-0.5, False)
    assert [claim.holds for claim in list_canonical_claims(70, 30.0, "SOG", None, 1.0)] == [
        None,
        None,
    ]


def test_a_stream_can_be_compared_with_its_own_estimate(data_and_summary):
    _, summary = data_and_summary
    file_claim, motion_claim, quality_claim = list_paper_claims(
        summary, [30, 31], summary, [30.5, 30.5]
    )

    assert file_claim.value == pytest.approx(amortize_file(summary) / amortize_estimate(summary))
    assert motion_claim.value == pytest.approx(list_motion_claims(summary)[0].value)
    assert (quality_claim.value, quality_claim.holds) == (0, True)


def test_4dgs_is_compared_as_a_whole_and_over_300_frames(data_and_summary):
    _, summary = data_and_summary
    file_claim, amortized_claim = list_fourdgs_claims(summary, 6000, 6000 + 3 * 500)

    assert file_claim.value == summary.total_bytes / 7500
    assert amortized_claim.value == pytest.approx(amortize_file(summary) / (6000 / 300 + 500))


def test_4dgs_is_compared_only_if_installed_and_something_moves(data_and_summary):
    _, summary = data_and_summary
    single_frame_summary = inspect_stream(make_stream(frame_count=1)[0])

    for claims in (
        list_fourdgs_claims(summary, None, None),
        list_fourdgs_claims(single_frame_summary, 6000, 6000),
    ):
        assert [claim.value for claim in claims] == [None, None]
