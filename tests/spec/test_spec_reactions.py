"""`recover` reacts as stated in the reaction column of SPEC 3.3: every row, every reaction."""

import pytest

from plain import spec_text
from quarc_ref.decoder import compute_digest
from quarc_ref.format.errors import BitstreamError
from quarc_ref.streams import Gap, decode, recover
from tests.spec.faulty_streams import FRAME_COUNT, STATES, VALID_STREAM, Case, cases

CASES = cases()
DIGESTS = [compute_digest(state.scene) for state in STATES]


def _recover(data: bytes) -> tuple[list[int], list[Gap]]:
    """Return the recovered frames and the gaps, after comparing the scenes with the stream's."""
    events = list(recover(data))
    gaps = [event for event in events if isinstance(event, Gap)]
    scenes = [event for event in events if not isinstance(event, Gap)]
    assert all(compute_digest(scene) == DIGESTS[scene.frame] for scene in scenes)
    return [scene.frame for scene in scenes], gaps


def test_the_stream_without_a_fault_is_valid():
    assert _recover(VALID_STREAM) == (list(range(FRAME_COUNT)), [])


def test_every_reaction_in_the_specification_has_a_case_and_no_other():
    specified = {
        (row["reject id"], reaction)
        for row in spec_text.read_records(spec_text.read_spec(), "rejects")
        for reaction in row["reaction"].split(", ")
    }

    assert {(case.reject_id, case.reaction) for case in CASES} == specified


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.reject_id}, {case.reaction}")
def test_a_recovering_reader_reacts_as_specified(case: Case):
    with pytest.raises(BitstreamError) as caught:
        list(decode(case.data))
    assert caught.value.reject_id == case.reject_id

    if case.reaction == "refuse":
        with pytest.raises(BitstreamError) as caught:
            list(recover(case.data))
        assert caught.value.reject_id == case.reject_id
        return
    frames, gaps = _recover(case.data)
    final_rejects = ["truncated"] if case.reject_id == "tail-mismatch" else []
    assert [gap.reject_id for gap in gaps] == [case.reject_id, *final_rejects]
    if case.reaction == "skip":
        assert frames == list(range(FRAME_COUNT))
        return
    assert frames == [*range(case.frame), *range(case.resume_frame, FRAME_COUNT)]
