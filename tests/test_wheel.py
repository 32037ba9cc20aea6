"""Tests that a wheel contains every file of the package, including files that are not modules."""

import shutil
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import pytest

ROOT = Path(__file__).resolve().parents[1]
_BUILD_PROGRAM = "from setuptools.build_meta import build_wheel; build_wheel('wheel')"


@pytest.fixture(scope="module")
def wheel_names(tmp_path_factory):
    """Names of all files in a wheel that is built from the sources."""
    folder = tmp_path_factory.mktemp("sources")
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, folder)
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "quarc_ref", folder / "quarc_ref", ignore=ignored)
    command = [sys.executable, "-c", _BUILD_PROGRAM]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    (wheel,) = (folder / "wheel").glob("*.whl")
    with ZipFile(wheel) as archive:
        return set(archive.namelist())


def test_type_checkers_find_the_types_of_the_package(wheel_names):
    assert "quarc_ref/py.typed" in wheel_names


def test_every_file_of_the_package_is_in_the_wheel(wheel_names):
    package_files = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "quarc_ref").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }

    assert package_files <= wheel_names
