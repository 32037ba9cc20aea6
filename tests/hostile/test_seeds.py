import pycolmap
import pytest

from quarc_ref.format.errors import BitstreamError
from quarc_ref.streams import decode
from tests.hostile import make_seeds


def _decode_outcome(data):
    try:
        return len(list(decode(data)))
    except BitstreamError as error:
        return error.reject_id


def _parse_model(folder, text_folder):
    """Return the words and the numbers of a COLMAP model in text form."""
    pycolmap.Reconstruction(folder).write_text(text_folder)
    words, numbers = [], []
    for path in sorted(text_folder.glob("*.txt")):
        for word in path.read_text().split():
            try:
                numbers.append(float(word))
            except ValueError:
                words.append(word)
    return words, numbers


def _list_names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_the_committed_seeds_can_be_regenerated():
    generated = dict(make_seeds.iterate_files())
    paths = [path for path in make_seeds.FOLDER.rglob("*.*") if "colmap" not in path.parts]
    committed = {
        path.relative_to(make_seeds.FOLDER).as_posix(): path.read_bytes() for path in paths
    }

    assert committed == generated


@pytest.mark.parametrize("file_format", ["binary", "text"])
def test_the_committed_colmap_models_can_be_regenerated(tmp_path, file_format):
    make_seeds.write_models(tmp_path)
    committed = make_seeds.FOLDER / "colmap" / file_format

    words, numbers = _parse_model(tmp_path / file_format, tmp_path)
    committed_words, committed_numbers = _parse_model(committed, tmp_path)

    assert _list_names(committed) == _list_names(tmp_path / file_format)
    assert words == committed_words
    # The last bits of poses and pixel positions depend on the processor's instructions.
    assert numbers == pytest.approx(committed_numbers, abs=1e-12)


def test_seeds_are_tiny_and_either_valid_or_rejected_as_their_name_says():
    outcomes = {name: _decode_outcome(data) for name, data in make_seeds.iterate_streams()}

    assert {name: outcome for name, outcome in outcomes.items() if isinstance(outcome, str)} == {
        "beyond_code": "code-range",
        "beyond_parent": "parent-range",
        "beyond_rotation": "rotation-range",
    }
    assert max(len(data) for _, data in make_seeds.iterate_streams()) < 1000
