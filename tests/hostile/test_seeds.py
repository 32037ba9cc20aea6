import pytest

from quarc_ref.format.errors import BitstreamError
from quarc_ref.streams import decode
from tests.hostile import make_seeds


def _decode_outcome(data):
    try:
        return len(list(decode(data)))
    except BitstreamError as error:
        return error.reject_id


def test_the_committed_seeds_can_be_regenerated():
    generated = dict(make_seeds.iterate_files())
    paths = [path for path in make_seeds.FOLDER.rglob("*.*") if "colmap" not in path.parts]
    committed = {
        path.relative_to(make_seeds.FOLDER).as_posix(): path.read_bytes() for path in paths
    }

    assert committed == generated


def test_the_committed_colmap_models_can_be_regenerated(tmp_path):
    pytest.importorskip("pycolmap")
    make_seeds.write_models(tmp_path)
    generated, committed = (
        {path.relative_to(folder): path.read_bytes() for path in sorted(folder.glob("*/*.*"))}
        for folder in (tmp_path, make_seeds.FOLDER / "colmap")
    )

    assert len(generated) == 10
    assert committed == generated


def test_seeds_are_tiny_and_either_valid_or_rejected_as_their_name_says():
    outcomes = {name: _decode_outcome(data) for name, data in make_seeds.iterate_streams()}

    assert {name: outcome for name, outcome in outcomes.items() if isinstance(outcome, str)} == {
        "beyond_code": "code-range",
        "beyond_parent": "parent-range",
        "beyond_rotation": "rotation-range",
    }
    assert max(len(data) for _, data in make_seeds.iterate_streams()) < 1000
