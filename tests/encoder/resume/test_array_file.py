import io
import json
import os

import numpy as np
import pytest

from quarc_ref.encoder.resume.array_file import (
    ArrayFileError,
    Layout,
    OtherKeyError,
    read_arrays,
    write_arrays,
)

_LAYOUT = Layout(
    {
        "step": ("<i8", ()),
        "rows": ("<f4", ("n", 3)),
        "more": ("<f4", ("n",)),
        "bits": ("|u1", (5,)),
    },
    {"n": range(1, 9)},
)


def _make_arrays(count=4):
    return {
        "step": np.array(7),
        "rows": np.arange(3 * count, dtype=np.float32).reshape(count, 3),
        "more": np.ones(count, np.float32),
        "bits": np.arange(5, dtype=np.uint8),
    }


def _read(path, data, key="key"):
    path.write_bytes(data)
    with path.open("rb") as file:
        return read_arrays(file, key, _LAYOUT)


def _build(arrays=None, header=None):
    sink = io.BytesIO()
    write_arrays(sink, "key", _make_arrays() if arrays is None else arrays)
    line, _, body = sink.getvalue().partition(b"\n")
    return json.dumps(json.loads(line) | (header or {})).encode() + b"\n" + body


def test_arrays_survive_a_round_trip_and_are_writable(tmp_path):
    for count in (1, 8):
        arrays = _make_arrays(count)
        read_back = _read(tmp_path / "a", _build(arrays))

        assert read_back.keys() == arrays.keys()
        for name, array in arrays.items():
            assert np.array_equal(read_back[name], array)
            assert (read_back[name].dtype, read_back[name].shape) == (array.dtype, array.shape)
            assert read_back[name].flags.writeable
            assert read_back[name].flags.aligned


_UNEXPECTED_ARRAYS = {
    "a name is missing": {"more": None},
    "a name is unknown": {"other": np.zeros(4, np.float32)},
    "another type": {"rows": np.zeros((4, 3))},
    "complex numbers": {"rows": np.zeros((4, 3), np.complex64)},
    "text": {"step": np.array("7")},
    "another rank": {"more": np.zeros((4, 1), np.float32)},
    "another width": {"rows": np.zeros((4, 2), np.float32)},
    "another number of rows": {"more": np.zeros(5, np.float32)},
    "no rows": {"rows": np.zeros((0, 3), np.float32), "more": np.zeros(0, np.float32)},
    "too many rows": {"rows": np.zeros((9, 3), np.float32), "more": np.zeros(9, np.float32)},
}


@pytest.mark.parametrize("changes", _UNEXPECTED_ARRAYS.values(), ids=_UNEXPECTED_ARRAYS)
def test_other_arrays_than_expected_are_rejected(changes, tmp_path):
    arrays = {
        name: array for name, array in (_make_arrays() | changes).items() if array is not None
    }
    with pytest.raises(ArrayFileError, match="expected arrays"):
        _read(tmp_path / "a", _build(arrays))


def test_arrays_of_another_key_are_rejected(tmp_path):
    with pytest.raises(OtherKeyError) as caught:
        _read(tmp_path / "a", _build(), key="other")

    assert caught.value.key != "other"


_SHAPES = json.loads(_build().partition(b"\n")[0])["arrays"]


@pytest.mark.parametrize(
    "header",
    [
        b"",
        b"\n",
        b"PK\x03\x04 an archive\n",
        b"null\n",
        b"[1]\n",
        b"\xff\n",
        b"[" * 60_000 + b"\n",
        b'{"key": "key"}\n',
        b'{"key": "key", "crc32": 0, "arrays": []}\n',
        b'{"key": "key", "crc32": 0, "arrays": {"step": 3}}\n',
        b'{"key": "key", "crc32": 0, "arrays": {"step": ["<i8", [0.5]]}}\n',
        b'{"key": "key", "crc32": 0, "arrays": {"step": ["<i8", ["1"]]}}\n',
        b'{"key": "key", "crc32": 0, "arrays": {"step": ["<i8", [' + b"9" * 5000 + b"]]}}\n",
        b" " * 70_000 + b"{}\n",
        {"arrays": _SHAPES | {"rows": ["O", [4, 3]]}},
        {"arrays": _SHAPES | {"rows": ["<f4", [-4, -3]]}},
        {"arrays": _SHAPES | {"rows": ["<f4", [10**30, 3]]}},
    ],
)
def test_an_invalid_header_is_rejected(header, tmp_path):
    with pytest.raises(ArrayFileError):
        _read(tmp_path / "a", header if isinstance(header, bytes) else _build(header=header))


@pytest.mark.parametrize("change", [-1, 1])
def test_a_file_of_another_length_is_rejected(change, tmp_path):
    data = _build()
    with pytest.raises(ArrayFileError, match="length"):
        _read(tmp_path / "a", data[:-1] if change < 0 else data + b"0")


@pytest.mark.parametrize("crc", [0, -1, None, "1", [], 1e400])
def test_a_wrong_checksum_is_rejected(crc, tmp_path):
    with pytest.raises(ArrayFileError, match="damaged"):
        _read(tmp_path / "a", _build(header={"crc32": crc}))


@pytest.mark.parametrize("position", range(1, 30, 4))
def test_a_flipped_bit_is_found(position, tmp_path):
    data = bytearray(_build())
    data[-position] ^= 1
    with pytest.raises(ArrayFileError, match="damaged"):
        _read(tmp_path / "a", bytes(data))


def test_no_more_is_read_than_a_layout_allows(tmp_path):
    with (tmp_path / "a").open("wb") as file:
        file.write(b'{"key": "key", "crc32": 0, "arrays": {"rows": ["<f4", [250000000000, 3]]}}\n')
        os.truncate(file.fileno(), 3 << 40)
    with (tmp_path / "a").open("rb") as file, pytest.raises(ArrayFileError):
        read_arrays(file, "key", _LAYOUT)
