"""Tests PLY files with a minimal parser, which shares no code with the writer."""

import struct

import numpy as np
import pytest

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.export.gaussian_ply import build_ply, parse_ply
from tests.export.frames import make_frame

_POSITION = ["x", "y", "z", "nx", "ny", "nz"]
_SHAPE = ["opacity", *(f"scale_{i}" for i in range(3)), *(f"rot_{i}" for i in range(4))]


def _read_vertices(data):
    """Return the header lines of a PLY file, and a dictionary of floats for each vertex."""
    header, separator, body = data.partition(b"end_header\n")
    assert separator
    lines = header.decode("ascii").splitlines()
    names = [line.split()[2] for line in lines if line.startswith("property")]
    rows = list(struct.iter_unpack(f"<{len(names)}f", body))
    return lines, [dict(zip(names, row, strict=True)) for row in rows]


@pytest.fixture(params=[0, 1])
def frame(request):
    return make_frame(request.param)


def test_the_header_is_that_of_3dgs(frame):
    _, splats = frame
    lines, vertices = _read_vertices(build_ply(splats))

    rest_names = [f"f_rest_{i}" for i in range(3 * (splats.sh.shape[1] - 1))]
    names = [*_POSITION, "f_dc_0", "f_dc_1", "f_dc_2", *rest_names, *_SHAPE]
    assert len(rest_names) in (0, 9)
    assert lines == [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(vertices)}",
        *(f"property float {name}" for name in names),
    ]


def test_every_gaussian_has_its_values(frame):
    scene, splats = frame
    _, vertices = _read_vertices(build_ply(splats))

    assert len(vertices) == scene.count
    for index, vertex in enumerate(vertices):
        assert [vertex[name] for name in ("x", "y", "z")] == splats.positions[index].tolist()
        assert [vertex[name] for name in ("nx", "ny", "nz")] == [0, 0, 0]
        assert [vertex[f"f_dc_{i}"] for i in range(3)] == splats.sh[index, 0].tolist()
        assert vertex["opacity"] == splats.opacities[index]
        assert [vertex[f"scale_{i}"] for i in range(3)] == splats.log_scales[index].tolist()
        assert [vertex[f"rot_{i}"] for i in range(4)] == splats.rotations[index].tolist()


def test_values_are_codes_times_steps():
    scene, splats = make_frame(1)
    header = scene.header
    _, vertices = _read_vertices(build_ply(splats))

    for index, vertex in enumerate(vertices):
        assert vertex["y"] == scene.positions[1, index] / 2**header.lattice_exponent
        assert vertex["rot_0"] == pytest.approx(scene.rotations[0, index] / 2**22, abs=2**-24)
        assert vertex["scale_2"] == scene.codes[2, index] * header.log_scale_step
        assert vertex["opacity"] == scene.codes[3, index] * header.opacity_step
        assert vertex["f_dc_1"] == scene.codes[5, index] * header.sh_dc_step


def test_sh_rest_is_stored_channel_by_channel():
    scene, splats = make_frame(1)
    _, vertices = _read_vertices(build_ply(splats))

    # Codes 7 to 15 are red, green, blue of the first coefficient, then of the next coefficients.
    for index, vertex in enumerate(vertices):
        for channel in range(3):
            for coefficient in range(3):
                code = scene.codes[7 + 3 * coefficient + channel, index]
                expected = code * scene.header.sh_rest_step
                assert vertex[f"f_rest_{3 * channel + coefficient}"] == expected


def test_quaternions_are_unit_and_begin_with_w():
    scene, splats = make_frame(1)
    _, vertices = _read_vertices(build_ply(splats))

    quaternions = np.array([[vertex[f"rot_{i}"] for i in range(4)] for vertex in vertices])
    assert np.linalg.norm(quaternions, axis=1) == pytest.approx(1, abs=1e-6)
    assert np.array_equal(np.round(quaternions.T * 2**22), scene.rotations)


@pytest.mark.parametrize("degree", [0, 1])
def test_a_frame_survives_a_round_trip(degree):
    _, splats = make_frame(degree)
    parsed = parse_ply(build_ply(splats))

    for field in ("positions", "log_scales", "opacities", "sh"):
        assert np.array_equal(getattr(parsed, field), getattr(splats, field))
    assert np.allclose(parsed.rotations, splats.rotations, atol=1e-6)


@pytest.mark.parametrize("coefficients", [9, 16])
def test_harmonics_of_other_methods_are_read_completely(coefficients):
    _, splats = make_frame(0)
    count = len(splats.positions)
    sh = np.random.default_rng(0).normal(size=(count, coefficients, 3)).astype(np.float32)
    data = build_ply(
        Splats(splats.positions, splats.rotations, splats.log_scales, splats.opacities, sh)
    )

    assert np.array_equal(parse_ply(data).sh, sh)


def test_rotations_are_normalized_and_values_can_be_doubles_or_text():
    _, splats = make_frame(0)
    scaled = Splats(
        splats.positions, 2 * splats.rotations, splats.log_scales, splats.opacities, splats.sh
    )
    lines, vertices = _read_vertices(build_ply(scaled))
    text = "\n".join(lines).replace("binary_little_endian", "ascii").replace("float", "double")
    rows = [" ".join(map(str, vertex.values())) for vertex in vertices]
    parsed = parse_ply("\n".join([text, "end_header", *rows, ""]).encode())

    assert np.allclose(parsed.rotations, splats.rotations, atol=1e-6)
    assert np.array_equal(parsed.positions, splats.positions)


def _build_with_opacity(value):
    _, splats = make_frame(0)
    opacities = splats.opacities.copy()
    opacities[0] = value
    return build_ply(
        Splats(splats.positions, splats.rotations, splats.log_scales, opacities, splats.sh)
    )


@pytest.mark.parametrize(
    ("make_data", "message"),
    [
        (lambda good: good[:-1], "ends before the last"),
        (lambda _: b"", "does not begin with a PLY header"),
        (lambda good: good.replace(b"float rot_3", b"float turn"), "no property rot_3"),
        (lambda good: good.replace(b"float rot_3", b"uchar rot_3"), "no property rot_3"),
        (lambda good: good.replace(b"float nx", b"float f_rest_0"), "1 properties f_rest"),
        (lambda _: _build_with_opacity(np.inf), "opacity of Gaussian 0 is inf"),
    ],
)
def test_other_files_than_gaussian_ply_are_rejected_by_name(make_data, message):
    with pytest.raises(ValueError, match=message):
        parse_ply(make_data(build_ply(make_frame(0)[1])))


def test_a_rotation_of_zeros_is_rejected():
    _, splats = make_frame(0)
    zeros = np.zeros_like(splats.rotations)

    with pytest.raises(ValueError, match="zero quaternion"):
        parse_ply(
            build_ply(
                Splats(splats.positions, zeros, splats.log_scales, splats.opacities, splats.sh)
            )
        )
