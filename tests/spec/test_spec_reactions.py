"""`recover` reacts as stated in the reaction column of SPEC 3.3: every row, every reaction."""

import pytest

from plain import spec_text
from quarc_ref.decoder import compute_digest
from quarc_ref.format.errors import BitstreamError
from quarc_ref.streams import Gap, decode, recover
from tests.spec.faulty_streams import FRAME_COUNT, STATES, WHOLE, Case, cases

CASES = cases()
DIGESTS = [compute_digest(state.scene) for state in STATES]


def _recover(data: bytes) -> tuple[list[int], list[Gap]]:
    """The frames and the gaps of a stream; every scene must be one of the intact stream."""
    events = list(recover(data))
    gaps = [event for event in events if isinstance(event, Gap)]
    scenes = [event for event in events if not isinstance(event, Gap)]
    assert all(compute_digest(scene) == DIGESTS[scene.frame] for scene in scenes)
    return [scene.frame for scene in scenes], gaps


def test_the_stream_without_a_fault_is_valid():
    assert _recover(WHOLE) == (list(range(FRAME_COUNT)), [])


def test_every_reaction_in_the_specification_has_a_case_and_no_other():
    message = {
        (row["reject id"], reaction)
        for row in spec_text.read_records(spec_text.read_spec(), "rejects")
        for reaction in row["reaction"].split(", ")
    }

    assert {(case.reject_id, case.reaction) for case in CASES} == message


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.reject_id}, {case.reaction}")
def test_a_recovering_reader_reacts_as_specified(case: Case):
    with pytest.raises(BitstreamError) as met:
        list(decode(case.data))
    assert met.value.reject_id == case.reject_id

    if case.reaction == "refuse":
        with pytest.raises(BitstreamError) as met:
            list(recover(case.data))
        assert met.value.reject_id == case.reject_id
        return
    frames, gaps = _recover(case.data)
    final_rejects = ["truncated"] if case.reject_id == "tail-mismatch" else []
    assert [gap.reject_id for gap in gaps] == [case.reject_id, *final_rejects]
    if case.reaction == "skip":
        assert frames == list(range(FRAME_COUNT))
        return
    assert frames == [*range(case.frame), *range(case.resumed, FRAME_COUNT)]
