import json
import math

import numpy as np
import pytest

from quarc_ref.viewing.paths.keyframes import parse_keyframes, read_keyframes
from quarc_ref.viewing.paths.pose import PathError, WorldAxes, get_camera_pose
from tests.cli.schemas import validate
from tests.viewing.paths.rigs import make_ring, mirror_cameras

_RING = make_ring(np.zeros(3))
_SCHEMA = "quarc-ref/camera-path/1"


def _parse(*keyframes, **extra_keys):
    document = {"schema": _SCHEMA, "keyframes": list(keyframes), **extra_keys}
    return parse_keyframes(json.dumps(document).encode(), _RING, _RING[0], WorldAxes())


def test_keyframes_are_cameras_of_the_stream_or_poses():
    path = [
        {"time": 1, "camera": "cam3"},
        {"time": 2.5, "position": [0, -2, 1], "target": [0, 0, 1], "fov": 30},
        {"time": 3, "position": [0, -2, 1], "target": [0, 0, 1], "up": [1, 0, 0]},
    ]
    keyframe_path = _parse(*path)
    validate({"schema": _SCHEMA, "keyframes": path})

    assert keyframe_path.times.tolist() == [0, 1.5, 2]
    assert keyframe_path.poses[0].eye == pytest.approx(get_camera_pose(_RING[3]).eye)
    assert keyframe_path.poses[1].axes == pytest.approx(
        np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]), abs=1e-12
    )
    assert keyframe_path.poses[1].view_angle == pytest.approx(math.radians(30))
    assert keyframe_path.poses[2].axes[1] == pytest.approx([-1, 0, 0])
    assert keyframe_path.poses[2].view_angle == pytest.approx(get_camera_pose(_RING[0]).view_angle)


def test_there_is_a_picture_for_every_moment_and_one_at_the_end():
    keyframe_path = _parse({"time": 0, "camera": "cam0"}, {"time": 0.5, "camera": "cam1"})

    assert keyframe_path.count_pictures(30) == 16
    poses = keyframe_path.interpolate(30)
    assert poses[0].eye == pytest.approx(keyframe_path.poses[0].eye)
    assert poses[-1].eye == pytest.approx(keyframe_path.poses[-1].eye)
    rounded_path = _parse({"time": 0, "camera": "cam0"}, {"time": 0.29, "camera": "cam1"})
    assert 0.29 * 100 < 29
    assert rounded_path.count_pictures(100) == 30


def test_keyframes_of_a_left_handed_stream_contain_its_reflection():
    cameras, _ = mirror_cameras(_RING)
    keyframes = [
        {"time": 0, "camera": "cam3"},
        {"time": 1, "position": [0, -2, 1], "target": [0, 0, 1]},
    ]
    document = json.dumps({"schema": _SCHEMA, "keyframes": keyframes}).encode()
    axes = WorldAxes(right_handed=False)
    poses = parse_keyframes(document, cameras, cameras[0], axes).interpolate(4)

    assert poses[0].axes == pytest.approx(get_camera_pose(cameras[3]).axes, abs=1e-6)
    assert poses[-1].axes == pytest.approx(np.array([[-1, 0, 0], [0, 0, -1], [0, 1, 0]]), abs=1e-12)
    assert [np.linalg.det(pose.axes) for pose in poses] == pytest.approx([-1] * 5)


def test_the_stream_plays_on_and_holds_its_last_frame():
    keyframe_path = _parse({"time": 0, "camera": "cam0"}, {"time": 1, "camera": "cam1"})

    times = keyframe_path.list_times(10, 3, 8)

    assert times == pytest.approx([3, 4, 5, 6, 7, 8, 8, 8, 8, 8, 8])


def test_named_frames_freeze_or_play_at_their_own_rate():
    keyframe_path = _parse(
        {"time": 0, "camera": "cam0", "frame": 2},
        {"time": 0.4, "camera": "cam1", "frame": 2},
        {"time": 0.8, "camera": "cam2"},
        {"time": 1, "camera": "cam3", "frame": 5},
    )

    times = keyframe_path.list_times(10, 0, 9)

    assert times == pytest.approx([2, 2, 2, 2, 2, 2.5, 3, 3.5, 4, 4.5, 5])


@pytest.mark.parametrize(
    ("keyframes", "message"),
    [
        ([], "must have only the keys"),
        ([{"camera": "cam0"}], "keyframe 0: the time is not a number"),
        ([{"time": True, "camera": "cam0"}], "the time is not a number"),
        ([{"time": 1e300, "camera": "cam0"}], "the time is not a number"),
        ([{"time": 0, "camera": "cam9"}], "no camera 'cam9'; its cameras are cam0, cam1"),
        ([{"time": 0, "camera": "cam0", "target": [0, 0, 0]}], "cannot be combined with"),
        ([{"time": 0, "position": [0, 0]}], "the position is not a list of three"),
        ([{"time": 0, "position": [0, 0, "1"]}], "the position is not"),
        ([{"time": 0, "position": [0, 0, 1]}], "the target is not"),
        ([{"time": 0, "position": [0, 0, 1], "target": [0, 0, 1]}], "are the same point"),
        ([{"time": 0, "camera": "cam0", "fov": 180}], "the fov of 180.0 degrees"),
        ([{"time": 0, "camera": "cam0", "fov": 5e-324}], "the fov of 5e-324 degrees"),
        ([{"time": 0, "camera": "cam0", "frame": -1}], "must be a frame number, not -1"),
        ([{"time": 0, "camera": "cam0", "speed": 1}], "may only have the keys"),
        ([{"time": 1, "camera": "cam0"}, {"time": 1, "camera": "cam1"}], "keyframe 1: the time"),
        (
            [{"time": 0, "camera": "cam0", "frame": 5}, {"time": 1, "camera": "cam0", "frame": 4}],
            "streams play only forward",
        ),
    ],
)
def test_an_impossible_path_is_rejected_by_name(keyframes, message):
    with pytest.raises(PathError, match=message):
        _parse(*keyframes)


def test_other_files_are_rejected_by_name(tmp_path):
    path = tmp_path / "a.json"
    for data, message in ((b"{", "not JSON"), (b"[]", "schema"), (b'{"schema": "x/1"}', "schema")):
        path.write_bytes(data)
        with pytest.raises(PathError, match=rf"a\.json: .*{message}"):
            read_keyframes(path, _RING, _RING[0], WorldAxes())
    with pytest.raises(PathError, match="only the keys"):
        _parse({"time": 0, "camera": "cam0"}, more=1)


def test_an_endless_path_is_not_rendered():
    keyframe_path = _parse({"time": 0, "camera": "cam0"}, {"time": 9e8, "camera": "cam1"})

    with pytest.raises(PathError, match="at most 1,048,576"):
        keyframe_path.interpolate(30)
