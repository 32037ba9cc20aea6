import cv2
import numpy as np
import pytest

from quarc_ref.datasets.errors import MissingFileError, UnreadableVideoError
from quarc_ref.datasets.stills import read_still
from tests.datasets import scenes


@pytest.fixture(scope="module")
def picture():
    return scenes.render(scenes.make_shots()[0], 0)


@pytest.mark.parametrize(("name", "tolerance"), [("a.png", 0), ("100%d.png", 0), ("a.jpg", 6)])
def test_a_picture_file_is_read(tmp_path, name, tolerance):
    ramp = np.linspace(40, 200, 64)
    picture = np.stack([*np.meshgrid(ramp, ramp), np.full((64, 64), 90.0)], axis=-1).astype(
        np.uint8
    )
    scenes.write_picture(tmp_path / name, picture)

    assert np.abs(read_still(tmp_path / name).astype(int) - picture).max() <= tolerance


@pytest.mark.parametrize("sampling", ["420", "422", "440", "444"])
def test_a_jpeg_file_is_as_bright_as_libjpeg_decodes_it(tmp_path, sampling):
    gray = np.tile(np.linspace(40, 200, 64), (64, 1))
    picture = np.stack([gray - 30, gray, gray + 50], axis=-1)
    factor = getattr(cv2, f"IMWRITE_JPEG_SAMPLING_FACTOR_{sampling}")
    cv2.imwrite(str(tmp_path / "a.jpg"), picture, [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, factor])
    expected = cv2.imread(str(tmp_path / "a.jpg"))[..., ::-1]

    bias = (read_still(tmp_path / "a.jpg") - expected.astype(float)).mean(axis=(0, 1))
    assert np.abs(bias).max() < 0.25


@pytest.mark.parametrize("size", [(64, 64), (63, 64), (64, 63), (63, 63)])
@pytest.mark.parametrize("sampling", ["420", "422", "440", "444"])
def test_the_colors_of_a_jpeg_file_are_where_libjpeg_decodes_them(tmp_path, sampling, size):
    picture = np.full((64, 64, 3), (200, 30, 30), np.uint8)
    picture[::16], picture[:, ::16] = 255, 255
    factor = getattr(cv2, f"IMWRITE_JPEG_SAMPLING_FACTOR_{sampling}")
    path, (width, height) = tmp_path / "a.jpg", size
    cv2.imwrite(str(path), picture[:height, :width], [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, factor])
    expected = cv2.imread(str(path))[..., ::-1]

    assert np.abs(read_still(path).astype(int) - expected).max() <= 3


def test_gray_and_transparent_pictures_are_read_as_rgb(tmp_path, picture):
    gray = picture[..., 0]
    cv2.imwrite(str(tmp_path / "gray.png"), gray)
    cv2.imwrite(str(tmp_path / "clear.png"), np.dstack([picture[..., ::-1], gray]))

    assert np.array_equal(read_still(tmp_path / "gray.png"), np.dstack([gray] * 3))
    assert np.array_equal(read_still(tmp_path / "clear.png"), picture)


@pytest.mark.parametrize("suffix", [".png", ".jpg"])
def test_a_picture_file_cut_in_half_is_rejected(tmp_path, picture, suffix):
    path = tmp_path / f"half{suffix}"
    scenes.write_picture(path, picture)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])

    with pytest.raises(UnreadableVideoError, match=f"half{suffix} cannot be decoded"):
        read_still(path)


def test_a_picture_file_with_a_wrong_byte_is_rejected(tmp_path, picture):
    path = tmp_path / "wrong.png"
    scenes.write_picture(path, picture)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)

    with pytest.raises(UnreadableVideoError, match=r"wrong.png"):
        read_still(path)


def test_a_missing_picture_file_is_named(tmp_path):
    with pytest.raises(MissingFileError, match=r"none.png"):
        read_still(tmp_path / "none.png")
