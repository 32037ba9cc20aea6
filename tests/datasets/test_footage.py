import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.datasets.errors import MissingFileError
from quarc_ref.datasets.footage import CaptureFiles, compute_fingerprint
from quarc_ref.datasets.natural_order import natural_order

MIB = 1 << 20


@pytest.fixture
def folder_and_files(tmp_path):
    return write_files(tmp_path / "capture")


def write_files(folder):
    folder.mkdir()
    (folder / "poses").write_bytes(b"poses")
    (folder / "a.mp4").write_bytes(bytes(3 * MIB))
    (folder / "b.mp4").write_bytes(b"short")
    (folder / "c.png").write_bytes(b"later")
    names = [[folder / "poses"], [folder / n for n in ("b.mp4", "a.mp4", "c.png")]]
    return folder, CaptureFiles(tuple(names[0]), tuple(names[1]), tuple(names[1][:2]))


def flip_bit(path, position):
    data = bytearray(path.read_bytes())
    data[position] ^= 1
    path.write_bytes(data)


def test_numbers_in_names_are_compared_as_numbers():
    names = ["cam_10", "cam_2", "cam", "cam_2b", "10", "9", "b1"]

    assert sorted(names, key=natural_order) == ["9", "10", "b1", "cam", "cam_2", "cam_2b", "cam_10"]


@given(st.lists(st.text()))
def test_any_names_can_be_sorted(names):
    assert len(sorted(names, key=natural_order)) == len(names)


def test_numbers_are_sorted_however_many_digits_they_have():
    names = ["1" * 5000, "2" * 4999, "007", "08", "0"]

    assert sorted(names, key=natural_order) == ["0", "007", "08", names[1], names[0]]


def test_a_fingerprint_does_not_depend_on_the_location_of_the_files(folder_and_files, tmp_path):
    other_folder = tmp_path / "elsewhere"
    other_folder.mkdir()

    assert compute_fingerprint(*folder_and_files) == compute_fingerprint(
        *write_files(other_folder / "renamed")
    )
    assert len(compute_fingerprint(*folder_and_files)) == 64


@pytest.mark.parametrize(
    ("name", "position"), [("poses", 2), ("a.mp4", 0), ("a.mp4", 3 * MIB - 1), ("b.mp4", 4)]
)
def test_a_fingerprint_changes_with_a_byte(folder_and_files, name, position):
    folder, files = folder_and_files
    fingerprint_before = compute_fingerprint(folder, files)
    flip_bit(folder / name, position)

    assert compute_fingerprint(folder, files) != fingerprint_before


def test_a_fingerprint_changes_with_a_size(folder_and_files):
    folder, files = folder_and_files
    fingerprint_before = compute_fingerprint(folder, files)
    (folder / "c.png").write_bytes(b"later still")

    assert compute_fingerprint(folder, files) != fingerprint_before


def test_a_fingerprint_changes_with_a_name(folder_and_files):
    folder, files = folder_and_files
    fingerprint_before = compute_fingerprint(folder, files)
    (folder / "c.png").rename(folder / "d.png")
    pictures = (*files.media_files[:2], folder / "d.png")

    assert (
        compute_fingerprint(
            folder, CaptureFiles(files.description_files, pictures, files.sampled_files)
        )
        != fingerprint_before
    )


def test_a_fingerprint_skips_the_middle_of_a_large_file(folder_and_files):
    folder, files = folder_and_files
    fingerprint_before = compute_fingerprint(folder, files)
    flip_bit(folder / "a.mp4", 3 * MIB // 2)

    assert compute_fingerprint(folder, files) == fingerprint_before


def test_a_deleted_file_is_named(folder_and_files):
    folder, files = folder_and_files
    (folder / "c.png").unlink()

    with pytest.raises(MissingFileError, match=r"c.png"):
        compute_fingerprint(folder, files)
