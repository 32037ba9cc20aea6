from dataclasses import replace

import pytest

from quarc_ref.inspection.inspect_stream import inspect_stream
from quarc_ref.inspection.stream_summary import KINDS
from rate.claims import (
    Claim,
    amortize,
    amortize_estimate,
    amortize_file,
    claim_against_paper,
    claim_canonical,
    claim_fourdgs,
    claim_motion,
)
from tests.small_streams import make_stream


@pytest.fixture(scope="module")
def stream():
    data, _ = make_stream(frame_count=4)
    return data, inspect_stream(data)


def _change(summary, index, **fields):
    frames = list(summary.frames)
    frames[index] = replace(frames[index], **fields)
    return replace(summary, frames=tuple(frames))


@pytest.mark.parametrize(
    ("value", "is_ceiling", "holds"),
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
def test_a_claim_holds_up_to_its_limit(value, is_ceiling, holds):
    assert Claim("some", value, 0.5, is_ceiling).holds is holds


def test_a_canonical_frame_serves_300_frames():
    assert amortize(3000, [4, 6]) == 15
    assert amortize(3000, []) == 10


def test_the_whole_file_is_amortized(stream):
    data, summary = stream
    moved = [frame.chunk_bytes for frame in summary.frames[1:]]

    wanted = (len(data) - sum(moved)) / 300 + sum(moved) / 3
    assert amortize_file(summary) == pytest.approx(wanted)


def test_the_estimate_leaves_out_what_the_paper_leaves_out(stream):
    _, summary = stream
    estimates = [frame.estimate_bytes for frame in summary.frames]

    moved = sum(each["motion"] + each["births"] for each in estimates) / 3
    wanted = estimates[0]["canonical"] / 300 + moved
    assert amortize_estimate(summary) == pytest.approx(wanted)


def test_motion_and_births_are_compared_over_all_frames(stream):
    _, summary = stream
    whole, _, newborn = claim_motion(summary)

    coded = summary.coded_bytes()
    estimate = sum(frame.estimate_bytes["motion"] for frame in summary.frames)
    assert whole.value == pytest.approx(coded["motion"] / estimate)
    assert newborn.value == coded["births"] / sum(frame.births for frame in summary.frames)


def test_one_bad_frame_is_the_worst(stream):
    _, summary = stream
    sizes = dict.fromkeys(KINDS, 0) | {"motion": 9000}
    price = dict.fromkeys(KINDS, 0.0) | {"motion": 300.0}

    bad = _change(summary, 2, coded_bytes=sizes, estimate_bytes=price)
    assert claim_motion(bad)[1].value == 30
    assert claim_motion(bad)[1].holds is False


def test_static_frames_have_no_ratio(stream):
    _, summary = stream
    price = {"canonical": 0.0, "motion": 0.0, "births": 0.0}
    still = summary
    for index in (1, 2, 3):
        still = _change(still, index, estimate_bytes=price)

    assert claim_motion(still)[0].value is None
    assert claim_motion(still)[1].value is None


def test_a_stream_of_one_frame_makes_no_claim_about_motion():
    summary = inspect_stream(make_stream(frame_count=1)[0])

    assert [claim.value for claim in claim_motion(summary)] == [None, None, None]


def test_a_canonical_frame_is_compared_in_bytes_and_in_quality():
    ratio, gain = claim_canonical(70, 30.0, "SPZ v4", (100, 30.5), 0.8)

    assert (ratio.value, ratio.holds) == (0.7, True)
    assert (gain.value, gain.holds) == (-0.5, False)
    assert [each.holds for each in claim_canonical(70, 30.0, "SOG", None, 1.0)] == [None, None]


def test_a_stream_can_be_compared_with_its_own_estimate(stream):
    _, summary = stream
    whole, motion, gain = claim_against_paper(summary, [30, 31], summary, [30.5, 30.5])

    assert whole.value == pytest.approx(amortize_file(summary) / amortize_estimate(summary))
    assert motion.value == pytest.approx(claim_motion(summary)[0].value)
    assert (gain.value, gain.holds) == (0, True)


def test_4dgs_is_compared_as_a_whole_and_over_300_frames(stream):
    _, summary = stream
    whole, amortized = claim_fourdgs(summary, 6000, 6000 + 3 * 500)

    assert whole.value == summary.total_bytes / 7500
    assert amortized.value == pytest.approx(amortize_file(summary) / (6000 / 300 + 500))


def test_4dgs_is_compared_only_if_installed_and_something_moves(stream):
    _, summary = stream
    still = inspect_stream(make_stream(frame_count=1)[0])

    for claims in (claim_fourdgs(summary, None, None), claim_fourdgs(still, 6000, 6000)):
        assert [claim.value for claim in claims] == [None, None]
