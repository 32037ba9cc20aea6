import pytest

from quarc_ref.format.errors import BitstreamError
from quarc_ref.streams import decode
from tests.hostile import make_seeds


def _outcome(data):
    try:
        return len(list(decode(data)))
    except BitstreamError as error:
        return error.reject_id


def test_the_committed_seeds_can_be_regenerated():
    made = dict(make_seeds.files())
    paths = [path for path in make_seeds.FOLDER.rglob("*.*") if "colmap" not in path.parts]
    committed = {
        path.relative_to(make_seeds.FOLDER).as_posix(): path.read_bytes() for path in paths
    }

    assert committed == made


def test_the_committed_colmap_models_can_be_regenerated(tmp_path):
    pytest.importorskip("pycolmap")
    make_seeds.write_models(tmp_path)
    made, committed = (
        {path.relative_to(folder): path.read_bytes() for path in sorted(folder.glob("*/*.*"))}
        for folder in (tmp_path, make_seeds.FOLDER / "colmap")
    )

    assert len(made) == 10
    assert committed == made


def test_seeds_are_tiny_and_either_valid_or_rejected_as_their_name_says():
    outcomes = {name: _outcome(data) for name, data in make_seeds.streams()}

    assert {name: found for name, found in outcomes.items() if isinstance(found, str)} == {
        "beyond_code": "code-range",
        "beyond_parent": "parent-range",
        "beyond_rotation": "rotation-range",
    }
    assert max(len(data) for _, data in make_seeds.streams()) < 1000
