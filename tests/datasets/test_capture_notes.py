import json
import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.datasets.capture_notes import NOTES_NAME, CaptureNotes
from quarc_ref.datasets.errors import MissingCameraError, UnreadableNotesError
from quarc_ref.datasets.notes_file import _KEYS, read_capture_notes, write_capture_notes
from tests.docs.pages import GUIDES


def test_notes_survive_a_round_trip(tmp_path):
    notes = CaptureNotes({"cam01": 2.5, "cam02": -3}, (0.0, -1.0, 0.0), 0.25, 29.97)

    write_capture_notes(tmp_path / NOTES_NAME, notes)

    assert read_capture_notes(tmp_path) == notes


def test_a_capture_without_the_file_has_empty_notes(tmp_path):
    assert read_capture_notes(tmp_path) == CaptureNotes({}, None, None)


def test_the_guide_lists_every_key():
    guide = (GUIDES / "captures.md").read_text("utf-8")
    (section,) = re.findall(r"^## quarc-capture\.json$(.*?)^## ", guide, re.MULTILINE | re.DOTALL)

    assert set(re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE)) == set(_KEYS)


def test_unknown_values_are_left_out_of_the_file(tmp_path):
    write_capture_notes(tmp_path / NOTES_NAME, CaptureNotes({"a": 1}))

    assert json.loads((tmp_path / NOTES_NAME).read_text()) == {"offsets": {"a": 1}}


def test_up_has_unit_length():
    assert CaptureNotes(up=(0, -3, 4)).up == pytest.approx((0, -0.6, 0.8))
    assert CaptureNotes(up=(1e300, 0, 1e300)).up == pytest.approx(
        (math.sqrt(0.5), 0, math.sqrt(0.5))
    )


def test_first_frames_are_rounded_offsets_with_a_minimum_of_0():
    notes = CaptureNotes({"a": -2.4, "b": 3.6})

    assert notes.first_frames(["a", "b", "c"]) == {"a": 0, "b": 6, "c": 2}
    assert CaptureNotes({"a": 5, "b": 7}).first_frames(["a", "b"]) == {"a": 0, "b": 2}


@pytest.mark.parametrize(
    ("offsets", "first_frames"),
    [
        ((0.5, 1.5), (0, 1)),
        ((1.5, 2.5), (0, 1)),
        ((0.4, 0.6), (0, 0)),
        ((0.9, 1.1, 3.0), (0, 0, 2)),
    ],
)
def test_only_differences_of_offsets_matter(offsets, first_frames):
    notes = CaptureNotes(dict(zip("abc", offsets, strict=False)))

    assert tuple(notes.first_frames("abc"[: len(offsets)]).values()) == first_frames


@given(st.lists(st.floats(-1000, 1000), min_size=2, max_size=6))
def test_no_common_shift_of_offsets_is_rounded_with_a_smaller_error(offsets):
    names = [str(index) for index in range(len(offsets))]
    frames = [*CaptureNotes(dict(zip(names, offsets, strict=True))).first_frames(names).values()]

    def spread(first_frames):
        return np.ptp(np.array(offsets) - first_frames)

    for shift in np.arange(0, 1, 0.05):
        assert spread(frames) <= spread(np.floor(np.array(offsets) - shift)) + 1e-6


def test_an_offset_of_an_unknown_camera_is_rejected_by_name():
    with pytest.raises(
        MissingCameraError, match=r"not in the capture: .*; the cameras are cam0, cam1"
    ):
        CaptureNotes({"cam9": 1}).first_frames(["cam0", "cam1"])


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("[]", "not a JSON object"),
        ("{", "Expecting"),
        (
            '{"shifts": {}}',
            "unknown keys: 'shifts'; the known keys are offsets, frames_per_second, up, "
            "meters_per_unit",
        ),
        ('{"offsets": [1]}', "'offsets' is not an object"),
        ('{"offsets": {"cam00": true}}', "the offset of cam00 is not a number"),
        ('{"offsets": {"cam00": 1e9}}', "it must be between -10,000,000 and 10,000,000 frames"),
        ('{"offsets": {"cam00": NaN}}', "it must be between -10,000,000 and 10,000,000 frames"),
        ('{"up": [0, 1]}', "'up' is not a list of three numbers"),
        ('{"up": [0, 0, 0]}', "it must consist of finite numbers"),
        ('{"up": [0, Infinity, 0]}', "it must consist of finite numbers"),
        ('{"meters_per_unit": 0}', "meters_per_unit is 0"),
        ('{"meters_per_unit": "1"}', "meters_per_unit is not a number"),
        ('{"frames_per_second": 0}', "frames_per_second is 0.0; it must be from 0.001 to"),
        ('{"frames_per_second": NaN}', "frames_per_second is nan"),
        ("[" * 10**5, "recursion"),
        (" " * (1 << 20) + "{}", "more than 1,048,576 bytes"),
    ],
)
def test_malformed_notes_are_rejected_by_name(tmp_path, text, error):
    (tmp_path / NOTES_NAME).write_text(text)

    with pytest.raises(UnreadableNotesError, match=error):
        read_capture_notes(tmp_path)


def test_any_finite_direction_can_be_up():
    huge, tiny = CaptureNotes(up=(0, 1e308, 1e308)).up, CaptureNotes(up=(0, 5e-324, 0)).up

    assert huge == pytest.approx((0, 0.5**0.5, 0.5**0.5))
    assert tiny == (0, 1, 0)
