"""Tests of pictures and videos that make FFmpeg open other files, wait, or fill the memory."""

import os
import shutil
import socket
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import cv2
import numpy as np
import pytest

from quarc_ref.datasets.errors import CaptureError, MissingFileError, UnreadableVideoError
from quarc_ref.datasets.layouts.transforms_json import read_nerfstudio
from quarc_ref.datasets.stills import read_still
from quarc_ref.datasets.video import VideoReader
from tests.datasets import forgeries, scenes

_TIME_LIMIT = 30.0  # seconds; calls usually take milliseconds
_SDP_SESSION = (
    "v=0\no=- 0 0 IN IP4 127.0.0.1\ns=x\nc=IN IP4 127.0.0.1\nt=0 0\n"
    "m=video 53998 RTP/AVP 96\na=rtpmap:96 H264/90000\n"
)
_CONCAT_SCRIPT = "ffconcat version 1.0\nfile cam01.mp4\n"
_HLS_PLAYLIST = (
    "#EXTM3U\n#EXT-X-VERSION:3\n#EXT-X-TARGETDURATION:1\n#EXT-X-MEDIA-SEQUENCE:0\n"
    "#EXTINF:0.2,\ncam01.mp4\n#EXT-X-ENDLIST\n"
)
_DASH_MANIFEST = (
    '<?xml version="1.0"?><MPD xmlns="urn:mpeg:dash:schema:mpd:2011" type="static">'
    '<Period><AdaptationSet mimeType="video/mp4"><Representation id="0">'
    "<BaseURL>cam01.mp4</BaseURL></Representation></AdaptationSet></Period></MPD>"
)
_TEXT_FORMATS = {
    "session": _SDP_SESSION,
    "concat script": _CONCAT_SCRIPT,
    "playlist": _HLS_PLAYLIST,
    "manifest": _DASH_MANIFEST,
}


def catch_error_in_time(read, *arguments):
    """Call a function in a thread, and return its error; fails if the call takes 30 seconds."""
    errors = []

    def call():
        try:
            read(*arguments)
        except Exception as error:
            errors.append(error)

    thread = threading.Thread(target=call, daemon=True)
    thread.start()
    thread.join(_TIME_LIMIT)
    assert not thread.is_alive(), f"the call takes more than {_TIME_LIMIT} s"
    return errors[0] if errors else None


@pytest.fixture
def folder(n3dv_folder, tmp_path, monkeypatch):
    """A copy of a capture as the current folder."""
    capture_copy = shutil.copytree(n3dv_folder, tmp_path / "copy")
    monkeypatch.chdir(capture_copy)
    return capture_copy


@pytest.mark.parametrize("text", _TEXT_FORMATS)
def test_text_that_names_other_paths_is_not_a_video(folder, text):
    (folder / "cam00.mp4").write_text(_TEXT_FORMATS[text])
    error = catch_error_in_time(VideoReader, folder / "cam00.mp4")

    assert isinstance(error, UnreadableVideoError)
    assert "cam00.mp4 cannot be opened as mp4, mov, mkv or webm" in str(error)


@pytest.mark.parametrize("text", _TEXT_FORMATS)
def test_text_that_names_other_paths_is_not_a_picture(folder, text):
    (folder / "cam00.png").write_text(_TEXT_FORMATS[text])
    error = catch_error_in_time(read_still, folder / "cam00.png")

    assert isinstance(error, UnreadableVideoError)
    assert "cam00.png cannot be decoded as a picture (the file is neither PNG nor JPEG)" in str(
        error
    )


@pytest.mark.parametrize("suffix", [".gif", ".bmp", ".tif"])
def test_a_picture_of_another_format_is_rejected_by_name(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    if not cv2.imwrite(str(path), np.zeros((8, 8, 3), np.uint8)):
        pytest.skip("OpenCV cannot write it")

    with pytest.raises(UnreadableVideoError, match=f"a{suffix} .*neither PNG nor JPEG"):
        read_still(path)


@pytest.fixture
def requests():
    """Paths requested from a local server, and the port of the server."""
    requested_paths = []

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            requested_paths.append(self.path)
            self.send_error(404)

        def log_message(self, *_arguments):
            pass

    with HTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield requested_paths, server.server_port
        server.shutdown()


@pytest.mark.parametrize("key", ["file_path", "ply_file_path"])
def test_an_address_in_transforms_json_is_not_fetched(folder, shots, requests, key):
    requested_paths, port = requests
    document = scenes.make_video_document(shots)
    entry = document if key == "ply_file_path" else document["frames"][0]
    entry[key] = f"http://127.0.0.1:{port}/cam00.mp4"
    scenes.write_transforms(folder, document)

    error = catch_error_in_time(read_nerfstudio, Path())
    assert requested_paths == []
    assert isinstance(error, CaptureError)
    assert "127.0.0.1" in str(error)


@pytest.mark.parametrize(
    "name",
    [
        "concat:cam00.mp4|cam01.mp4",
        "subfile,,start,0,end,0,,:cam00.mp4",
        "file:cam00.mp4",
        "cache:cam00.mp4",
        "async:cam00.mp4",
        "crypto:cam00.mp4",
    ],
)
def test_a_protocol_in_transforms_json_is_treated_as_a_file_name(folder, shots, name):
    document = scenes.make_video_document(shots)
    document["frames"][0]["file_path"] = name
    scenes.write_transforms(folder, document)
    error = catch_error_in_time(read_nerfstudio, Path())

    assert isinstance(error, MissingFileError)
    assert name in str(error)


@pytest.mark.parametrize(
    "name",
    ["100%d", "%05d", "a:b", "file:a", "concat:a", "subfile,,a", "http:a", "a|b", "a*b?[c]", "-i"],
)
def test_a_name_can_only_mean_a_file(folder, pictures, name):
    (folder / "cam00.mp4").rename(folder / f"{name}.mp4")
    scenes.write_picture(folder / "a.png", pictures[0][0])
    (folder / "a.png").rename(folder / f"{name}.png")

    for path in (folder / f"{name}.mp4", Path(f"{name}.mp4")):
        assert np.array_equal(VideoReader(path).read(3), pictures[0][3])
    for path in (folder / f"{name}.png", Path(f"{name}.png")):
        assert np.array_equal(read_still(path), pictures[0][0])


def _make_fifo(path):
    os.mkfifo(path)


def _make_socket(path):
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(path))


def _link_device(path):
    path.symlink_to("/dev/null")


@pytest.mark.parametrize("read", [VideoReader, read_still])
@pytest.mark.parametrize("make_special_file", [_make_fifo, _make_socket, _link_device, os.mkdir])
def test_only_a_regular_file_is_opened(tmp_path, monkeypatch, read, make_special_file):
    monkeypatch.chdir(tmp_path)
    path = Path("cam00")
    make_special_file(path)
    error = catch_error_in_time(read, path)

    assert isinstance(error, UnreadableVideoError)
    assert str(error) == "cam00 is not a regular file"


@pytest.mark.parametrize("read", [VideoReader, read_still])
@pytest.mark.parametrize("name", ["a\0b", "\ud800", "x" * 300])
def test_an_impossible_file_name_is_rejected(tmp_path, read, name):
    with pytest.raises(MissingFileError, match="is missing or cannot be opened"):
        read(tmp_path / name)


def test_a_video_whose_frames_are_in_another_file_is_rejected(folder):
    data = (folder / "cam00.mp4").read_bytes()
    (folder / "cam00.mov").write_bytes(forgeries.reference_other_file(data, "cam01.mp4"))

    with pytest.raises(CaptureError, match=r"cam00.mov"):
        VideoReader(folder / "cam00.mov")


def test_a_picture_that_would_fill_the_memory_is_rejected_by_its_header(tmp_path):
    data = forgeries.forge_png(16_000, 16_000)
    (tmp_path / "a.png").write_bytes(data)

    assert len(data) < 40_000
    with pytest.raises(
        UnreadableVideoError, match=r"a.png .*16000 x 16000 are too large: the limits are"
    ):
        read_still(tmp_path / "a.png")


def test_a_jpeg_that_would_fill_the_memory_is_rejected_by_its_header(tmp_path):
    scenes.write_picture(tmp_path / "a.jpg", np.zeros((32, 48, 3), np.uint8))
    small_jpeg = (tmp_path / "a.jpg").read_bytes()
    size_offset = small_jpeg.index(b"\0\x20\0\x30")
    large_jpeg = (
        small_jpeg[:size_offset] + (16_000).to_bytes(2, "big") * 2 + small_jpeg[size_offset + 4 :]
    )
    (tmp_path / "a.jpg").write_bytes(large_jpeg)

    with pytest.raises(UnreadableVideoError, match="16000 x 16000 are too large"):
        read_still(tmp_path / "a.jpg")


def test_a_video_whose_frames_would_fill_the_memory_is_rejected(tmp_path):
    path, large_png = tmp_path / "cam00.mov", forgeries.forge_png(16_000, 16_000)
    forgeries.write_pngs_as_video(path, [large_png, large_png], (48, 32))

    with pytest.raises(UnreadableVideoError, match=r"has more than 134,217,728 pixels per frame"):
        VideoReader(path)


def test_a_frame_that_would_fill_the_memory_is_rejected_in_mid_stream(tmp_path):
    path, pngs = tmp_path / "cam00.mov", [forgeries.forge_png(48, 32)] * 12
    forgeries.write_pngs_as_video(path, [*pngs, forgeries.forge_png(16_000, 16_000)], (48, 32))
    reader = VideoReader(path)

    assert reader.read(0).shape == (32, 48, 3)
    with pytest.raises(UnreadableVideoError, match=r"frame 12 of .*cannot be decoded"):
        reader.read(12)


def test_a_video_without_an_available_decoder_is_rejected_by_name(folder):
    data = (folder / "cam00.mp4").read_bytes().replace(b"avc1", b"zzzz")
    (folder / "cam00.mp4").write_bytes(data)

    with pytest.raises(UnreadableVideoError, match=r"no decoder is available for the video"):
        VideoReader(folder / "cam00.mp4")


def test_a_picture_file_without_end_is_not_read_completely(tmp_path, monkeypatch):
    monkeypatch.setattr("quarc_ref.datasets.media._MAX_STILL_BYTES", 1 << 10)
    path = tmp_path / "a.png"
    with path.open("wb") as file:
        file.write(forgeries.forge_png(48, 32))
        file.truncate(1 << 20)

    with pytest.raises(UnreadableVideoError, match=r"a.png has more than 1,024 bytes"):
        read_still(path)
