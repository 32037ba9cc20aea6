import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quarc_ref.datasets.colmap_sizes import require_whole
from tests.datasets import scenes


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    folder = tmp_path_factory.mktemp("model")
    return scenes.write_model(folder, scenes.make_shots(), scenes.plane_points(9))


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    return tmp_path_factory.mktemp("copy")


def test_what_colmap_writes_is_whole(model):
    require_whole(model)


def test_a_text_model_is_passed_over(tmp_path):
    require_whole(scenes.write_model(tmp_path, scenes.make_shots(), text=True))


@settings(deadline=None, max_examples=50)
@given(data=st.data())
@pytest.mark.parametrize("name", ["images.bin", "points3D.bin"])
def test_a_file_cut_anywhere_or_prolonged_is_refused(model, copy, name, data):
    whole = (model / name).read_bytes()
    length = data.draw(st.integers(0, len(whole) - 1))
    for path in copy.iterdir():
        path.unlink()

    for wrong in (whole[:length], whole + b"\0"):
        (copy / name).write_bytes(wrong)
        with pytest.raises(ValueError, match=f"{name} is not as long as its records"):
            require_whole(copy)


@pytest.mark.parametrize("name", ["images.bin", "points3D.bin"])
def test_a_count_beyond_the_file_is_refused(tmp_path, model, name):
    whole = (model / name).read_bytes()
    (tmp_path / name).write_bytes(struct.pack("<Q", 1 << 62) + whole[8:])

    with pytest.raises(ValueError, match="not as long"):
        require_whole(tmp_path)
