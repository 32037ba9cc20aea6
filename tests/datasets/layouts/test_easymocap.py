import re
import shutil

import pytest

from quarc_ref.datasets.layouts.easymocap import read_easymocap
from tests.datasets.layouts.builders import build_easymocap_videos


@pytest.fixture
def folder(traced_capture, tmp_path):
    build_easymocap_videos(traced_capture, tmp_path)
    return tmp_path


def renumber(folder, first, second):
    """Rename the first two cameras."""
    for old, new in (("00", first), ("01", second)):
        shutil.move(folder / "videos" / f"{old}.mp4", folder / "videos" / f"{new}.mp4")
        for name in ("intri.yml", "extri.yml"):
            text = (folder / name).read_text().replace(f'"{old}"', f'"{new}"')
            (folder / name).write_text(text.replace(f"_{old}:", f"_{new}:"))


@pytest.mark.parametrize("names", [("00", "01"), ("08", "010")])
@pytest.mark.parametrize("style", ["\n   - {}\n   - {}\n   - 02\n   - 03", " [ {}, {}, 02, 03 ]"])
def test_names_without_quotes_are_those_of_the_matrices(folder, names, style):
    renumber(folder, *names)
    for path in (folder / "intri.yml", folder / "extri.yml"):
        _, matrices = re.split(r"(?=^[KR]_)", path.read_text(), maxsplit=1, flags=re.MULTILINE)
        path.write_text(f"%YAML:1.0\n---\nnames:{style.format(*names)}\n{matrices}")

    assert {camera.name for camera in read_easymocap(folder).cameras} == {*names, "02", "03"}
