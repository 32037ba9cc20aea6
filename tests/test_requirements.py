"""Tests that requirements/ and pyproject.toml agree, and that `compare.py` finds differences."""

import importlib.util
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

ROOT = Path(__file__).parents[1]
LOCKED_EXTRAS = ("media", "train", "export", "dev")
LOCK_TEXT = """\
alpha==1.0 \\
    --hash=sha256:00
beta==2.0 ; sys_platform == 'nowhere' \\
    --hash=sha256:00
gamma==3.0 ; python_version >= '3' \\
    --hash=sha256:00
"""

_spec = importlib.util.spec_from_file_location("compare", ROOT / "requirements" / "compare.py")
assert _spec is not None
assert _spec.loader is not None
compare = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(compare)


def test_every_requirement_of_the_project_is_locked_within_its_range():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    requirements = [
        *project["dependencies"],
        *(requirement_text for name in LOCKED_EXTRAS for requirement_text in extras[name]),
    ]
    locked_versions = compare.read_locks(ROOT / "requirements")
    for requirement in map(Requirement, requirements):
        if requirement.marker is None or requirement.marker.evaluate():
            version = locked_versions[canonicalize_name(requirement.name)]
            assert requirement.specifier.contains(version, prereleases=True), requirement


def test_every_locked_version_has_hashes():
    for lock in (ROOT / "requirements").glob("*.txt"):
        entries = lock.read_text().split("\n    --hash=sha256:")
        pinned_lines = [line for line in lock.read_text().splitlines() if "==" in line]
        assert len(entries) > len(pinned_lines) > 20
        assert all(line.endswith("\\") for line in pinned_lines)


def test_a_lock_gives_the_versions_for_this_platform(tmp_path):
    (tmp_path / "main.txt").write_text(LOCK_TEXT)
    assert compare.read_locks(tmp_path) == {"alpha": Version("1.0"), "gamma": Version("3.0")}


def test_another_version_and_a_package_without_a_lock_are_named(tmp_path, capsys):
    other_folder = tmp_path / "other"
    other_folder.mkdir()
    (tmp_path / "main.txt").write_text(LOCK_TEXT)
    (other_folder / "main.txt").write_text("alpha==1.1 \\\ndelta==4.0 \\\n")
    assert compare.main(str(tmp_path), str(other_folder)) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines == [
        "alpha: 1.0 is locked, 1.1 is here",
        "delta: no version is locked, 4.0 is here",
    ]


@pytest.mark.parametrize("version", ["1.0", "1.0+cpu"])
def test_a_local_build_of_the_locked_version_counts_as_locked(monkeypatch, version):
    class _Installed:
        name = "Alpha"

        def __init__(self) -> None:
            self.version = version

    monkeypatch.setattr(compare, "distributions", lambda: [_Installed()])
    assert compare.list_installed() == {"alpha": Version("1.0")}


def test_no_message_installs_the_package_by_its_name_which_is_not_registered():
    modules = (ROOT / "quarc_ref").rglob("*.py")

    assert [path.name for path in modules if "quarc-ref[" in path.read_text("utf-8")] == []
