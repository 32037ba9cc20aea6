import io
import zipfile

import numpy as np
import pytest

from quarc_ref.export.arrays_npz import build_npz
from tests.export.frames import make_frame

_STATE_ARRAYS = {"ids": "ids", "positions": "state_positions", "rotations": "state_rotations"}
_STATE_ARRAYS["codes"] = "state_codes"
_FLOAT_ARRAYS = ("positions", "rotations", "log_scales", "opacities", "sh")


@pytest.fixture(params=[0, 1])
def frame(request):
    return make_frame(request.param)


def _read_arrays(data):
    """Return the arrays of an archive; fail if the archive contains a pickle."""
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}


def test_the_integer_state_is_exported_unchanged(frame):
    scene, splats = frame
    arrays = _read_arrays(build_npz(scene, splats))

    for field, name in _STATE_ARRAYS.items():
        assert np.array_equal(arrays[name], getattr(scene, field))
        assert arrays[name].dtype == (np.int64 if field == "ids" else np.int32)


def test_the_floats_are_exported_exactly(frame):
    scene, splats = frame
    arrays = _read_arrays(build_npz(scene, splats))

    for name in _FLOAT_ARRAYS:
        assert arrays[name].dtype == np.float32
        assert arrays[name].shape == getattr(splats, name).shape
        assert arrays[name].tobytes() == getattr(splats, name).tobytes()


def test_nothing_else_is_exported(frame):
    assert _read_arrays(build_npz(*frame)).keys() == {*_STATE_ARRAYS.values(), *_FLOAT_ARRAYS}


def test_arrays_are_stored_uncompressed(frame):
    with zipfile.ZipFile(io.BytesIO(build_npz(*frame))) as archive:
        assert archive.testzip() is None
        assert {entry.compress_type for entry in archive.infolist()} == {zipfile.ZIP_STORED}


def test_the_archive_does_not_depend_on_the_time_of_writing(frame):
    with zipfile.ZipFile(io.BytesIO(build_npz(*frame))) as archive:
        assert {entry.date_time for entry in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
