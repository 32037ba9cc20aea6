import struct

import pycolmap
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quarc_ref.datasets.layouts.colmap_sizes import require_complete_files
from tests.datasets import scenes

_WALKED = ["images.bin", "points3D.bin", "rigs.bin", "frames.bin"]


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    folder = tmp_path_factory.mktemp("model")
    return scenes.write_model(folder, scenes.make_shots(), scenes.make_plane_points(9))


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    return tmp_path_factory.mktemp("copy")


def test_output_of_colmap_is_complete(model):
    require_complete_files(model)


def test_a_text_model_is_ignored(tmp_path):
    require_complete_files(scenes.write_model(tmp_path, scenes.make_shots(), text=True))


@settings(deadline=None, max_examples=50)
@given(data=st.data())
@pytest.mark.parametrize("name", _WALKED)
def test_a_truncated_or_prolonged_file_is_rejected(model, copy, name, data):
    whole = (model / name).read_bytes()
    length = data.draw(st.integers(0, len(whole) - 1))
    for path in copy.iterdir():
        path.unlink()

    for wrong in (whole[:length], whole + b"\0"):
        (copy / name).write_bytes(wrong)
        with pytest.raises(ValueError, match=f"the length of {name} does not match its records"):
            require_complete_files(copy)


@pytest.mark.parametrize("name", _WALKED)
def test_a_count_beyond_the_file_is_rejected(tmp_path, model, name):
    whole = (model / name).read_bytes()
    (tmp_path / name).write_bytes(struct.pack("<Q", 1 << 62) + whole[8:])

    with pytest.raises(ValueError, match="does not match its records"):
        require_complete_files(tmp_path)


@pytest.mark.parametrize("name", ["points3D.bin", "images.bin"])
def test_a_count_beyond_any_file_size_is_rejected(tmp_path, model, name):
    whole = (model / name).read_bytes()
    (tmp_path / name).write_bytes(whole[:-8] + b"\xff" * 8 + whole)

    with pytest.raises(ValueError, match="does not match its records"):
        require_complete_files(tmp_path)


def test_a_rig_of_several_sensors_is_complete(tmp_path):
    model = pycolmap.Reconstruction()
    rig = pycolmap.Rig(rig_id=1)
    for number, pose in enumerate((None, pycolmap.Rigid3d(), None), 1):
        camera = pycolmap.Camera(model="PINHOLE", width=4, height=4, params=[1, 1, 1, 1])
        camera.camera_id = number
        model.add_camera(camera)
        if number == 1:
            rig.add_ref_sensor(camera.sensor_id)
        else:
            rig.add_sensor(camera.sensor_id, pose)
    model.add_rig(rig)
    model.write_binary(tmp_path)

    assert (tmp_path / "rigs.bin").stat().st_size == 8 + 16 + (9 + 56) + 9
    require_complete_files(tmp_path)
