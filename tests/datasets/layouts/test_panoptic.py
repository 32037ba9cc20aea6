import json
import shutil

import pytest

from quarc_ref.datasets.errors import CountMismatchError, UnreadablePoseError
from quarc_ref.datasets.layouts.panoptic import read_panoptic
from tests.datasets.layouts.builders import build_panoptic_videos

NAME = "calibration_room.json"


@pytest.fixture
def folder(traced_capture, tmp_path):
    build_panoptic_videos(traced_capture, tmp_path)
    return tmp_path


def test_of_two_calibrations_none_is_chosen(folder):
    shutil.copy(folder / NAME, folder / "calibration_1.json")

    with pytest.raises(CountMismatchError, match=f"has calibration_1.json and {NAME}: keep only"):
        read_panoptic(folder)


def test_of_two_entries_of_a_camera_none_is_chosen(folder):
    document = json.loads((folder / NAME).read_bytes())
    document["cameras"].append(document["cameras"][-1])
    (folder / NAME).write_text(json.dumps(document))

    with pytest.raises(UnreadablePoseError, match=f"{NAME} has two entries of camera 00_03: "):
        read_panoptic(folder)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"K": [[100, 9, 32], [0, 100, 24], [0, 0, 1]]}, "the skew 9 in K moves pixels"),
        ({"resolution": [0, 48]}, "picture sizes and focal lengths must be positive"),
        ({"K": None}, "'K' is missing"),
    ],
)
def test_a_camera_that_cannot_be_used_is_named(folder, change, reason):
    document = json.loads((folder / NAME).read_bytes())
    entry = document["cameras"][-1] | change
    document["cameras"][-1] = {key: value for key, value in entry.items() if value is not None}
    (folder / NAME).write_text(json.dumps(document))

    with pytest.raises(UnreadablePoseError, match=f"{NAME}: camera 00_03: {reason}"):
        read_panoptic(folder)
