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
