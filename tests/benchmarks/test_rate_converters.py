import pytest

from rate import converters
from rate.converters import (
    UnavailableError,
    convert_and_restore,
    describe_spz,
    install_splat_transform,
    read_splat_transform_version,
)
from tests.export.frames import make_frame


def test_the_version_of_spz_is_read_from_its_bytes():
    assert describe_spz(b"NGSP\x04\x00\x00\x00rest") == "SPZ v4"
    assert describe_spz(b"\x1f\x8b\x08") == "SPZ, gzipped, v3 or older"


def test_without_npm_the_program_is_unavailable(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))

    assert read_splat_transform_version(tmp_path) is None
    with pytest.raises(UnavailableError, match="npm is not installed"):
        install_splat_transform(tmp_path / "node")


def test_a_program_that_fails_is_unavailable_and_says_why(tmp_path, monkeypatch):
    program = tmp_path / "fails"
    program.write_text("#!/bin/sh\necho first >&2\necho the reason >&2\nexit 3\n")
    program.chmod(0o755)
    monkeypatch.setattr(converters, "install_splat_transform", lambda _folder: program)

    with pytest.raises(UnavailableError, match="fails: the reason"):
        convert_and_restore(make_frame(0)[1], "sog", tmp_path)
