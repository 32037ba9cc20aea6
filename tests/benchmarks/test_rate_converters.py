import numpy as np
import pytest

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.export.gaussian_ply import build_ply
from rate import converters
from rate.converters import (
    NotAtHandError,
    convert_scene,
    install,
    name_spz,
    parse_ply,
    tell_version,
)
from tests.export.frames import make_frame


@pytest.mark.parametrize("degree", [0, 1])
def test_a_written_scene_is_read_back(degree):
    _, splats = make_frame(degree)
    read = parse_ply(build_ply(splats))

    for field in ("positions", "log_scales", "opacities", "sh"):
        assert np.array_equal(getattr(read, field), getattr(splats, field))
    assert np.allclose(read.rotations, splats.rotations, atol=1e-6)


def test_harmonics_beyond_degree_1_are_left_out():
    rng = np.random.default_rng(0)
    sh = rng.normal(size=(5, 16, 3)).astype(np.float32)
    rotations = np.tile(np.array([1, 0, 0, 0], dtype=np.float32), (5, 1))
    zeros = np.zeros((5, 3), dtype=np.float32)
    read = parse_ply(build_ply(Splats(zeros, rotations, zeros, zeros[:, 0], sh)))

    assert np.array_equal(read.sh, sh[:, :4])


def test_rotations_come_back_as_units():
    _, splats = make_frame(0)
    doubled = Splats(
        splats.positions, 2 * splats.rotations, splats.log_scales, splats.opacities, splats.sh
    )

    assert np.allclose(np.linalg.norm(parse_ply(build_ply(doubled)).rotations, axis=1), 1)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda data: data[:-1],
        lambda data: data[:-4],
        lambda data: data + bytes(4),
        lambda data: data.replace(b"binary_little_endian", b"ascii"),
        lambda data: data.replace(b"property float x", b"property double x"),
    ],
)
def test_another_file_is_refused(spoil):
    with pytest.raises(ValueError, match=r"PLY|rows|multiple"):
        parse_ply(spoil(build_ply(make_frame(0)[1])))


def test_comments_of_a_header_are_passed_over():
    data = build_ply(make_frame(0)[1])

    assert np.array_equal(
        parse_ply(data.replace(b"1.0\n", b"1.0\ncomment made by hand\n", 1)).sh, parse_ply(data).sh
    )


def test_the_version_of_spz_is_what_its_bytes_tell():
    assert name_spz(b"NGSP\x04\x00\x00\x00rest") == "SPZ v4"
    assert name_spz(b"\x1f\x8b\x08") == "SPZ, gzipped, v3 or older"


def test_without_npm_the_program_is_not_at_hand(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))

    assert tell_version(tmp_path) is None
    with pytest.raises(NotAtHandError, match="npm is not installed"):
        install(tmp_path / "node")


def test_a_program_that_fails_is_not_at_hand_and_says_why(tmp_path, monkeypatch):
    program = tmp_path / "fails"
    program.write_text("#!/bin/sh\necho first >&2\necho the reason >&2\nexit 3\n")
    program.chmod(0o755)
    monkeypatch.setattr(converters, "install", lambda _folder: program)

    with pytest.raises(NotAtHandError, match="fails: the reason"):
        convert_scene(make_frame(0)[1], "sog", tmp_path)
