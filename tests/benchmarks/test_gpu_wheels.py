import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from gpu.plan import STEPS
from gpu.wheels import REQUIREMENTS_PATH, install_missing, read_requirements
from tests.test_requirements import compare

_ROOT = Path(__file__).resolve().parents[2]
# Packages that a machine with a GPU lacks and the list of wheels does not contain.
_ABSENT = ("cv2", "pycolmap", "typer", "matplotlib")


def test_the_steps_need_only_listed_packages():
    modules = [step.module for step in STEPS]
    program = f"""
import sys
from importlib import import_module
for name in {_ABSENT!r}:
    sys.modules[name] = None
for name in {modules!r}:
    import_module(name)
"""
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(_ROOT / "benchmarks"), str(_ROOT)]),
    }
    completed = subprocess.run(
        [sys.executable, "-c", program],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )

    assert completed.returncode == 0, completed.stderr


def test_wheels_have_the_locked_versions():
    locked_versions = compare.read_locks(_ROOT / "requirements")
    listed_versions = dict(line.split("==") for line in read_requirements())
    differing_names = {
        name
        for name, version in listed_versions.items()
        if str(locked_versions.get(name, version)) != version
    }

    assert differing_names == set()
    assert listed_versions.keys() - locked_versions.keys() == {
        "gsplat",
        "jaxtyping",
        "ninja",
        "wadler-lindig",
    }
    assert REQUIREMENTS_PATH.name == "wheels.txt"


def test_installed_packages_are_kept(tmp_path, monkeypatch):
    monkeypatch.setattr("gpu.wheels.read_requirements", lambda: ["numpy==0.1", "pytest==0.1"])

    assert install_missing(tmp_path) == "nothing is missing"


def test_missing_packages_are_installed_once_and_only_from_wheels(tmp_path, monkeypatch):
    monkeypatch.setattr("gpu.wheels.read_requirements", lambda: ["tiny-thing==1.0", "numpy==0.1"])
    _write_wheel(tmp_path)

    assert install_missing(tmp_path) == "installed tiny-thing==1.0"
    assert (tmp_path / "installed" / "tiny_thing.py").is_file()
    assert install_missing(tmp_path) == "nothing is missing"


def test_the_fast_engine_is_installed_if_its_wheel_is_there(tmp_path, monkeypatch):
    monkeypatch.setattr("gpu.wheels.read_requirements", list)
    monkeypatch.setattr("gpu.wheels._is_installed", lambda *_: False)
    _write_wheel(tmp_path, "quarc_core")

    assert install_missing(tmp_path) == "installed quarc-core"
    assert (tmp_path / "installed" / "quarc_core.py").is_file()


def test_a_missing_wheel_is_named_and_the_others_are_installed(tmp_path, monkeypatch):
    packages = ["no-such-package==1.0", "tiny-thing==1.0", "none-either==2.0"]
    monkeypatch.setattr("gpu.wheels.read_requirements", lambda: packages)
    _write_wheel(tmp_path)

    with pytest.raises(RuntimeError, match=r"no-such-package.*none-either"):
        install_missing(tmp_path)
    assert (tmp_path / "installed" / "tiny_thing.py").is_file()


def _write_wheel(folder, name="tiny_thing"):
    info_folder = f"{name}-1.0.dist-info"
    with zipfile.ZipFile(folder / f"{name}-1.0-py3-none-any.whl", "w") as wheel:
        wheel.writestr(f"{name}.py", "")
        wheel.writestr(
            f"{info_folder}/METADATA", f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n"
        )
        wheel_metadata = "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
        wheel.writestr(f"{info_folder}/WHEEL", wheel_metadata)
        wheel.writestr(f"{info_folder}/RECORD", "")
