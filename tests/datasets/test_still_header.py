import struct

import numpy as np
import pytest

from quarc_ref.datasets.still_header import StillHeader, read_still_header
from tests.datasets import forgeries, scenes


@pytest.fixture(scope="module")
def jpeg(tmp_path_factory):
    path = tmp_path_factory.mktemp("still") / "a.jpg"
    scenes.write_picture(path, np.zeros((32, 48, 3), np.uint8))
    return path.read_bytes()


def test_the_size_is_read(jpeg):
    assert read_still_header(forgeries.forge_png(48, 32)) == StillHeader("png", 48, 32, 1)
    assert read_still_header(jpeg) == StillHeader("mjpeg", 48, 32, 1)


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("orientation", range(1, 9))
def test_the_orientation_is_read(jpeg, orientation, order):
    exif = forgeries.forge_exif(orientation, order)

    assert read_still_header(forgeries.add_exif(jpeg, exif)).orientation == orientation
    assert read_still_header(forgeries.forge_png(48, 32, exif)).orientation == orientation


@pytest.mark.parametrize(
    "exif",
    [
        b"",
        b"II*\0",
        b"II*\0\xff\xff\xff\xff",
        b"XX*\0\x08\0\0\0",
        forgeries.forge_exif(6)[:30],
        forgeries.forge_exif(0),
        forgeries.forge_exif(9),
    ],
)
def test_a_malformed_orientation_is_none(jpeg, exif):
    assert read_still_header(forgeries.add_exif(jpeg, exif)).orientation == 1
    assert read_still_header(forgeries.forge_png(48, 32, exif)).orientation == 1


def test_stray_bytes_and_fill_bytes_between_segments_are_skipped(jpeg):
    padded_jpeg = jpeg[:2] + b"\xff\xff\xff" + jpeg[3:20] + b"\0\xff\0" + jpeg[20:]

    assert read_still_header(padded_jpeg) == read_still_header(jpeg)


def test_segments_without_a_length_are_skipped(jpeg):
    assert read_still_header(jpeg[:2] + b"\xff\x01\xff\xd0" + jpeg[2:]) == read_still_header(jpeg)


@pytest.mark.parametrize("data", [b"", b"GIF89a", b"RIFF....WEBP", b"\x89PN", b"\xff\xd8"])
def test_another_format_is_named(data):
    with pytest.raises(ValueError, match="neither PNG nor JPEG"):
        read_still_header(data)


def test_a_truncated_header_is_rejected(jpeg):
    png = forgeries.forge_png(48, 32)
    frame_end = jpeg.index(b"\xff\xc0") + 9

    for data in [png[:length] for length in range(8, 37)]:
        with pytest.raises(ValueError, match=r"is truncated|not a PNG header"):
            read_still_header(data)
    for data in [jpeg[:length] for length in range(3, frame_end)]:
        with pytest.raises(ValueError, match=r"is truncated|no JPEG frame header"):
            read_still_header(data)


def test_a_png_with_another_first_chunk_is_rejected():
    png = forgeries.forge_png(48, 32)
    chunk = struct.pack(">I4s", 0, b"tEXt") + bytes(4)

    with pytest.raises(ValueError, match="not a PNG header"):
        read_still_header(png[:8] + chunk + png[8:])


@pytest.mark.parametrize("filler", [b"\xff\xd0", b"\xff\xfe\0\x02", b"\xff", b"\0"])
def test_a_jpeg_without_a_frame_header_is_rejected(jpeg, filler):
    long_jpeg = jpeg[:2] + b"\xff\xfe\0\x02" + filler * 2_000_000

    with pytest.raises(ValueError, match=r"is truncated|no JPEG frame header"):
        read_still_header(long_jpeg)
