import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from quarc_ref.datasets.capture import Points
from quarc_ref.datasets.errors import MissingFileError, UnreadablePointsError
from quarc_ref.datasets.points_ply import read_points_ply, write_points_ply

PROPERTIES = ("float x", "float y", "float z", "uchar red", "uchar green", "uchar blue")
POINT_BYTES = bytes(4 * 3) + b"\x01\x02\x03"

position_arrays = hnp.arrays(
    np.float32,
    st.tuples(st.integers(1, 20), st.just(3)),
    elements=st.floats(allow_nan=False, allow_infinity=False, width=32),
)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return tmp_path_factory.mktemp("ply") / "points.ply"


def make_ply(
    body, properties=PROPERTIES, count="1", ply_format="binary_little_endian 1.0", newline="\n"
):
    lines = [
        "ply",
        f"format {ply_format}",
        "comment end_header is not here",
        f"element vertex {count}",
    ]
    lines += [f"property {property_text}" for property_text in properties]
    return newline.join([*lines, "end_header", ""]).encode() + body


@settings(deadline=None, max_examples=50)
@given(positions=position_arrays, seed=st.integers(0, 99))
def test_points_survive_a_round_trip(path, positions, seed):
    colors = np.random.default_rng(seed).integers(0, 256, positions.shape, dtype=np.uint8)
    write_points_ply(path, Points(positions, colors))
    points = read_points_ply(path)

    assert np.array_equal(points.positions.view(np.uint32), positions.view(np.uint32))
    assert np.array_equal(points.colors, colors)
    assert (points.positions.dtype, points.colors.dtype) == (np.float32, np.uint8)


def test_writing_leaves_nothing_next_to_the_file(tmp_path):
    write_points_ply(
        tmp_path / "a.ply", Points(np.zeros((1, 3), np.float32), np.zeros((1, 3), "u1"))
    )

    assert os.listdir(tmp_path) == ["a.ply"]


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_ascii_points_are_read(path, newline):
    body = newline.join(["1.5 -2 3e1 0 128 255", "0 0 0 1 2 3", ""]).encode()
    path.write_bytes(make_ply(body, count="2", ply_format="ascii 1.0", newline=newline))
    points = read_points_ply(path)

    assert points.positions.tolist() == [[1.5, -2, 30], [0, 0, 0]]
    assert points.colors.tolist() == [[0, 128, 255], [1, 2, 3]]


def test_other_properties_and_elements_are_skipped(path):
    properties = [
        "double x",
        "float nx",
        "double y",
        "double z",
        "int label",
        *PROPERTIES[3:],
        "uchar alpha",
    ]
    layout = "<f8,<f4,<f8,<f8,<i4,u1,u1,u1,u1"
    body = np.array([(1, 9, 2, 3, -7, 10, 20, 30, 255)] * 2, dtype=layout).tobytes()
    head = make_ply(b"", [*properties, "uchar mask"][:-1], count="2")
    faces = b"element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    path.write_bytes(head.replace(b"end_header\n", faces) + body + b"\x03" + bytes(12))
    points = read_points_ply(path)

    assert points.positions.tolist() == [[1, 2, 3]] * 2
    assert points.colors.tolist() == [[10, 20, 30]] * 2


@pytest.mark.parametrize(
    ("data", "error"),
    [
        (b"", "does not begin with a PLY header"),
        (b"plx\nend_header\n", "does not begin with a PLY header"),
        (b"ply\nformat ascii 1.0\n" + b"comment\n" * 10000, "does not begin with a PLY header"),
        (b"ply\nend_header\n", "neither ascii nor"),
        (make_ply(POINT_BYTES, ply_format="binary_big_endian 1.0"), "neither ascii nor"),
        (b"ply\nformat ascii 1.0\nend_header\n", "first element is not 'vertex'"),
        (
            b"ply\nformat binary_little_endian 1.0\nelement chunk 2\nend_header\n",
            "a compressed PLY",
        ),
        (make_ply(POINT_BYTES, count="0"), "no points"),
        (make_ply(POINT_BYTES, count="-1"), "no points"),
        (make_ply(POINT_BYTES, count="many"), "no points"),
        (make_ply(POINT_BYTES, count="1 2"), "no points"),
        (make_ply(POINT_BYTES, count="2"), "ends before the last of 2 points"),
        (make_ply(POINT_BYTES[:-1]), "ends before"),
        (make_ply(POINT_BYTES, count="9" * 30), "ends before"),
        (make_ply(b"1 2 3 4 5 6", count="9" * 30, ply_format="ascii 1.0"), "lines of 6 numbers"),
        (make_ply(b"1 2 3 4 5 6\n1 2", count="2", ply_format="ascii 1.0"), "lines of 6 numbers"),
        (make_ply(b"1 2 3 4 5 x\n", ply_format="ascii 1.0"), "could not convert"),
        (make_ply(b"1 2 3 4 5 256\n", ply_format="ascii 1.0"), "color is not between"),
        (make_ply(b"1 2 3 4 5 nan\n", ply_format="ascii 1.0"), "color is not between"),
        (make_ply(b"1 2 inf 4 5 6\n", ply_format="ascii 1.0"), r"point 0 \(1, 2, inf\): remove"),
        (make_ply(b"1 2 1e300 4 5 6\n", ply_format="ascii 1.0"), "not finite"),
        (make_ply(b"\xff" * 15), "not finite"),
        (make_ply(POINT_BYTES, [*PROPERTIES, "list uchar int other"]), "is not supported"),
        (make_ply(POINT_BYTES, [*PROPERTIES, "half w"]), "is not supported"),
        (make_ply(POINT_BYTES * 2, [*PROPERTIES, "float x"]), "x"),
        (make_ply(POINT_BYTES, PROPERTIES[1:]), "no properties x, y and z"),
        (make_ply(POINT_BYTES, ["int x", *PROPERTIES[1:]]), "x, y and z of type float or double"),
        (make_ply(POINT_BYTES, PROPERTIES[:3]), "no properties red, green and blue"),
        (
            make_ply(POINT_BYTES * 2, [*PROPERTIES[:5], "float blue"]),
            "no properties red, green and blue",
        ),
    ],
)
def test_a_malformed_file_is_rejected_by_name(path, data, error):
    path.write_bytes(data)

    with pytest.raises(UnreadablePointsError, match=error) as error_info:
        read_points_ply(path)
    assert str(path) in str(error_info.value)


@settings(deadline=None, max_examples=100)
@given(data=st.data())
def test_a_wrong_byte_gives_points_or_a_named_error(path, data):
    file_bytes = bytearray(make_ply(POINT_BYTES * 3, count="3"))
    file_bytes[data.draw(st.integers(0, len(file_bytes) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(file_bytes[: data.draw(st.integers(0, len(file_bytes)))])

    try:
        points = read_points_ply(path)
    except UnreadablePointsError:
        return
    assert points.positions.shape == points.colors.shape


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(MissingFileError, match=r"none.ply"):
        read_points_ply(tmp_path / "none.ply")
