import json
import math

import numpy as np
import pytest

from quarc_ref.datasets.errors import (
    MissingFileError,
    UnreadablePoseError,
    UnsupportedCameraError,
)
from quarc_ref.datasets.layouts.transforms_entries import read_transforms
from tests.datasets import scenes

SHARED = {"w": 48, "h": 32, "fl_x": 40, "fl_y": 41.5, "cx": 24, "cy": 16}
FRAME = {"file_path": "a.png", "transform_matrix": np.eye(4).tolist()}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "transforms.json"


def read(path, document):
    path.write_text(json.dumps(document))
    return read_transforms(path)


def test_shared_intrinsics_hold_for_every_entry_unless_it_has_its_own(path):
    own = {**FRAME, "file_path": "b.png", "fl_x": 50, "k1": 0.1}
    first, second = read(path, {**SHARED, "k2": 0.2, "frames": [FRAME, own]}).entries

    assert (first.lens.fx, first.lens.fy, first.lens.cx, first.lens.cy) == (40, 41.5, 24, 16)
    assert first.lens.coefficients[:2] == (0, 0.2)
    assert second.lens.fx == 50
    assert second.lens.coefficients[:2] == (0.1, 0.2)


def test_angles_of_view_replace_missing_focal_lengths(path):
    sizes = {"w": 48, "h": 32, "camera_angle_x": math.pi / 2}
    own = {**FRAME, "camera_angle_y": 2 * math.atan(0.5), "cx": 20, "cy": 15}
    first, second = read(path, {**sizes, "frames": [FRAME, own]}).entries

    assert (first.lens.fx, first.lens.fy, first.lens.cx, first.lens.cy) == pytest.approx(
        (24, 24, 24, 16)
    )
    assert (second.lens.fx, second.lens.fy) == pytest.approx((24, 32))
    assert (second.lens.cx, second.lens.cy) == (20, 15)


def test_focal_lengths_take_precedence_over_angles_of_view(path):
    (entry,) = read(path, {**SHARED, "camera_angle_x": 1.0, "frames": [FRAME]}).entries

    assert (entry.lens.fx, entry.lens.fy) == (40, 41.5)


class SharedEntries(dict):
    """Shared values of all entries; counts how often they are read."""

    walks = 0

    def __iter__(self):
        SharedEntries.walks += 1
        return super().__iter__()

    def keys(self):
        SharedEntries.walks += 1
        return super().keys()

    def items(self):
        SharedEntries.walks += 1
        return super().items()


def test_shared_values_are_parsed_once_for_all_entries(path, monkeypatch):
    document = SharedEntries(SHARED, frames=[FRAME] * 50)
    monkeypatch.setattr(
        "quarc_ref.datasets.layouts.transforms_entries.json.loads", lambda _: document
    )
    path.touch()

    assert len(read_transforms(path).entries) == 50
    assert document.walks == 0


def test_a_shared_path_pose_or_time_is_ignored(path):
    for key, value in {"file_path": "a.png", "transform_matrix": np.eye(4).tolist()}.items():
        lacking = {name: FRAME[name] for name in FRAME if name != key}
        with pytest.raises(UnreadablePoseError, match=r"'file_path' is missing|not 4x4"):
            read(path, {**SHARED, key: value, "frames": [lacking]})
    assert read(path, {**SHARED, "time": 3, "frames": [FRAME]}).entries[0].time is None


def test_coefficients_are_in_the_order_of_opencv(path):
    named = {"k1": 1, "k2": 2, "k3": 3, "k4": 4, "k5": 5, "k6": 6, "p1": 7, "p2": 8}
    document = {**SHARED, **named, "frames": [FRAME]}
    perspective = read(path, {**document, "camera_model": "OPENCV"}).entries[0].lens
    fisheye = read(path, {**document, "camera_model": "OPENCV_FISHEYE"}).entries[0].lens

    assert perspective.coefficients == (1, 2, 7, 8, 3, 4, 5, 6)
    assert fisheye.coefficients == (1, 2, 3, 4)
    assert fisheye.fisheye


@pytest.mark.parametrize("model", ["SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL"])
def test_a_model_with_fewer_coefficients_is_that_of_opencv(path, model):
    document = {**SHARED, "k1": 0.1, "frames": [FRAME]}
    lenses = [
        read(path, {**document, "camera_model": name}).entries[0].lens for name in (model, "OPENCV")
    ]

    assert lenses[0] == lenses[1]


@pytest.mark.parametrize("is_fisheye", [False, True])
def test_instant_ngp_marks_fisheye_lenses_without_a_model(path, is_fisheye):
    named = {"k1": 1, "k2": 2, "k3": 3, "k4": 4, "is_fisheye": is_fisheye}
    lens = read(path, {**SHARED, **named, "frames": [FRAME]}).entries[0].lens

    assert lens.fisheye == is_fisheye
    assert lens.coefficients[:4] == ((1, 2, 3, 4) if is_fisheye else (1, 2, 0, 0))


def test_a_pose_is_converted_from_the_axes_of_opengl(path):
    shot = scenes.make_shots()[1]
    frame = {**FRAME, "transform_matrix": scenes.make_opengl_matrix(shot)}
    (entry,) = read(path, {**SHARED, "frames": [frame]}).entries
    pose = entry.pose()

    assert np.allclose(pose.rotation, shot.axes.T, atol=1e-12)
    assert np.allclose(pose.translation, -shot.axes.T @ shot.center, atol=1e-12)


def test_a_matrix_of_three_rows_is_enough(path):
    frame = {**FRAME, "transform_matrix": np.eye(4)[:3].tolist()}

    assert len(read(path, {**SHARED, "frames": [frame]}).entries[0].camera_to_world) == 12


def test_the_last_row_of_a_matrix_may_be_rounded(path):
    rows = [*np.eye(4)[:3].tolist(), [0, 1e-9, -0.0, 1.0000001]]

    assert read(path, {**SHARED, "frames": [{**FRAME, "transform_matrix": rows}]}).entries


@pytest.mark.parametrize("last_row", [[0, 0, 0, 2], [1, 2, 3, 1], [0, 0, 0, float("nan")]])
def test_another_last_row_of_a_matrix_is_rejected(path, last_row):
    rows = [*np.eye(4)[:3].tolist(), last_row]

    with pytest.raises(UnreadablePoseError, match=r"a.png: the last row .* may be transposed"):
        read(path, {**SHARED, "frames": [{**FRAME, "transform_matrix": rows}]})


def test_rate_points_and_times_are_read_from_their_keys(path):
    reported = read(
        path,
        {**SHARED, "fps": 25, "ply_file_path": "p.ply", "frames": [{**FRAME, "time": 0.5}]},
    )
    untold = read(path, {**SHARED, "frames": [FRAME]})

    assert (reported.frames_per_second, reported.points_path, reported.entries[0].time) == (
        25,
        "p.ply",
        0.5,
    )
    values = (untold.frames_per_second, untold.points_path, untold.entries[0].time)
    assert values == (None, None, None)


@pytest.mark.parametrize(
    ("document", "error"),
    [
        ([], "no list 'frames'"),
        ({}, "no list 'frames'"),
        ({"frames": {}}, "no list 'frames'"),
        ({"frames": []}, "'frames' is empty"),
        ({"frames": [1]}, "item 0 of 'frames' is not an object"),
        ({**SHARED, "frames": [{"transform_matrix": []}]}, "'file_path' is missing"),
        ({**SHARED, "frames": [{"file_path": "a.png"}]}, "frame a.png: .*not 4x4"),
        ({**SHARED, "frames": [{**FRAME, "transform_matrix": [[1], [1, 2]]}]}, "frame a.png"),
        ({**SHARED, "frames": [{**FRAME, "transform_matrix": "abc"}]}, "frame a.png"),
        ({**SHARED, "frames": [{**FRAME, "fl_x": "40"}]}, "frame a.png: 'fl_x' is missing, or no"),
        ({"w": 48, "h": 32, "camera_angle_x": 4, "frames": [FRAME]}, "between 0 and pi radians"),
        ({**SHARED, "frames": [{**FRAME, "fl_x": True}]}, "'fl_x' is missing, or no"),
        ({**SHARED, "frames": [{**FRAME, "fl_x": -1}]}, "must be positive"),
        ({**SHARED, "frames": [{**FRAME, "fl_x": 10**400}]}, "too large"),
        ({**SHARED, "frames": [{**FRAME, "cx": float("nan")}]}, "not finite"),
        ({**SHARED, "frames": [{**FRAME, "w": 48.5}]}, "not a whole number"),
        ({**SHARED, "frames": [{**FRAME, "time": None}]}, "'time' is missing, or no"),
        ({**SHARED, "fps": 0, "frames": [FRAME]}, "'fps' is 0"),
        ({**SHARED, "ply_file_path": 1, "frames": [FRAME]}, "'ply_file_path' is missing, or no"),
    ],
)
def test_a_malformed_document_is_rejected_by_name(path, document, error):
    with pytest.raises(UnreadablePoseError, match=error) as error_info:
        read(path, document)
    assert str(path) in str(error_info.value)


@pytest.mark.parametrize("key", sorted(SHARED))
def test_a_missing_intrinsic_is_named(path, key):
    document = {name: value for name, value in SHARED.items() if name != key}

    with pytest.raises(UnreadablePoseError, match=f"'{key}' is missing"):
        read(path, {**document, "frames": [FRAME]})


@pytest.mark.parametrize("data", [b"", b"{", b"\xff\xfe", b"[" * 100_000])
def test_a_file_that_is_not_json_is_rejected(path, data):
    path.write_bytes(data)

    with pytest.raises(UnreadablePoseError, match=r"transforms.json is no"):
        read_transforms(path)


@pytest.mark.parametrize("model", ["EQUIRECTANGULAR", None])
def test_an_unsupported_camera_model_is_named(path, model):
    with pytest.raises(UnsupportedCameraError, match=f"camera model {model} is not supported"):
        read(path, {**SHARED, "camera_model": model, "frames": [FRAME]})


def test_a_missing_file_is_named(path):
    with pytest.raises(MissingFileError) as raised:
        read_transforms(path)
    assert str(raised.value) == f"{path} cannot be read: No such file or directory"
