import pytest

from quarc_ref.datasets.capture_notes import CaptureNotes
from quarc_ref.encoder.world_frame import describe_up, find_up_axis, set_world_frame
from quarc_ref.format.records import StreamHeader


@pytest.mark.parametrize(
    ("up", "axis"),
    [((1, 0, 0), 1), ((0, -1, 0), 4), ((0, 0, 2), 5), ((0.001, -1, 0), 4), ((0, 0.5, 1), 0)],
)
def test_an_up_axis_is_named_in_the_header(up, axis):
    assert find_up_axis(CaptureNotes(up=up)) == axis


def test_an_up_direction_between_axes_is_metadata():
    assert describe_up(CaptureNotes(up=(0, 3, 4))) == {"up": "0.000000 0.600000 0.800000"}
    assert describe_up(CaptureNotes(up=(0, -1, 0))) == describe_up(CaptureNotes()) == {}


def test_the_header_states_what_the_notes_know():
    header = set_world_frame(StreamHeader(), CaptureNotes(up=(0, -1, 0), meters_per_unit=0.1))

    assert header.up_axis == 4
    assert header.meters_per_unit == pytest.approx(0.1)
    assert set_world_frame(StreamHeader(), CaptureNotes()) == StreamHeader()
