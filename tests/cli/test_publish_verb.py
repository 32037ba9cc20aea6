import base64
import os
import sys
from pathlib import Path, PureWindowsPath

import pytest

from quarc_ref.cli.page_options import make_page_title
from quarc_ref.datasets.stills import read_still
from quarc_ref.viewing.page import read_player
from tests.cli.commands import list_names, run, run_json
from tests.cli.processes import run_piped
from tests.small_streams import CAMERA
from tests.sound_files import find_click, make_wav, write_video


def test_a_folder_has_everything_that_a_page_needs(stream_file, tmp_path):
    folder = tmp_path / "site"
    json_output = run_json("publish", stream_file, "-o", folder)

    names = ["index.html", "poster.jpg", "quarc-player.js", "stream.quarc"]
    assert json_output["files"] == list_names(folder) == names
    assert (folder / "stream.quarc").read_bytes() == stream_file.read_bytes()
    assert (folder / "quarc-player.js").read_bytes() == read_player()
    assert (json_output["frames"], json_output["bytes"]) == (4, stream_file.stat().st_size)
    assert json_output["iframe"].startswith('<iframe src="site/" title="small" width="960"')


@pytest.mark.parametrize("name", ["C:\\Users\\me\\scene.quarc", "C:/Users/me/scene.quarc"])
def test_the_default_title_has_no_folders_on_windows(name, monkeypatch):
    monkeypatch.setattr("quarc_ref.cli.options.Path", PureWindowsPath)

    assert make_page_title(name) == "scene"


@pytest.mark.parametrize(
    ("platform", "command"),
    [
        ("linux", "python3 -m http.server --directory 'my site'"),
        ("win32", 'python -m http.server --directory "my site"'),
    ],
)
def test_the_command_that_serves_a_folder_is_for_the_shell_of_the_system(
    platform, command, stream_file, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "platform", platform)

    assert command in run("publish", stream_file, "-o", "my site").stdout


def test_a_single_page_contains_everything(stream_file, tmp_path):
    page_path = tmp_path / "page.html"
    json_output = run_json("publish", stream_file, "-o", page_path, "--title", "A <b>", "--loop")
    page = page_path.read_text("utf-8")

    assert (json_output["folder"], json_output["poster"]) == (None, None)
    assert json_output["page"] == str(page_path)
    assert json_output["files"] == ["page.html"]
    assert "<title>A &lt;b&gt;</title>" in page
    assert _find_data(page, "application/octet-stream") == stream_file.read_bytes()
    assert _find_data(page, "text/javascript") == read_player()
    assert page.count("data:image/jpeg;base64,") == 1
    assert json_output["iframe"].startswith('<iframe src="page.html" title="A &lt;b&gt;"')


def test_a_trailing_slash_means_a_folder(stream_file, tmp_path):
    run_json("publish", stream_file, "-o", f"{tmp_path}/site/")
    result = run("publish", stream_file, "-o", f"{tmp_path}/page.html/")

    assert "index.html" in list_names(tmp_path / "site")
    assert result.exit_code == 2
    assert "page.html must be a folder" in result.stderr
    assert not (tmp_path / "page.html").exists()


def _find_data(page, media_type):
    return base64.b64decode(page.split(f"data:{media_type};base64,")[1].split('"')[0])


@pytest.mark.skipif(sys.platform != "linux", reason="file names of other systems are text")
def test_a_stream_whose_name_is_not_valid_utf_8_is_published(stream_file, tmp_path):
    path = tmp_path / os.fsdecode(b"sc\xe8ne.quarc")
    stream_file.rename(path)
    result = run("publish", path, "-o", tmp_path / "page.html")

    assert result.exit_code == 0, result.stderr
    assert "<title>sc?ne</title>" in (tmp_path / "page.html").read_text("utf-8")
    assert 'title="sc' in result.stdout


def test_the_url_of_a_single_page_is_that_of_the_iframe(stream_file, tmp_path):
    url = "https://example.org/a/page.html"
    json_output = run_json("publish", stream_file, "-o", tmp_path / "p.html", "--url", url)

    assert f'src="{url}"' in json_output["iframe"]


def test_a_single_page_replaces_a_file_only_with_force(stream_file, tmp_path):
    page_path = tmp_path / "page.htm"
    page_path.write_text("mine")
    results = [run("publish", stream_file, "-o", page_path, *force) for force in ([], ["--force"])]

    assert [result.exit_code for result in results] == [2, 0]
    assert page_path.read_text("utf-8").startswith("<!doctype html>")


def test_a_stream_that_is_too_large_for_a_single_page_is_rejected(
    stream_file, tmp_path, monkeypatch
):
    monkeypatch.setattr("quarc_ref.viewing.site.SINGLE_PAGE_LIMIT", stream_file.stat().st_size - 1)
    result = run("publish", stream_file, "-o", tmp_path / "page.html")

    assert result.exit_code == 2
    assert "give the name of a folder" in result.stderr
    assert not (tmp_path / "page.html").exists()


def test_the_poster_shows_the_view_of_the_camera(stream_file, tmp_path):
    run_json("publish", stream_file, "-o", tmp_path / "site")
    run_json("render", stream_file, "-o", tmp_path / "frame.png", "--frames", 0)
    poster, rendered_picture = (
        read_still(tmp_path / name) for name in ("site/poster.jpg", "frame.png")
    )

    assert poster.shape == (CAMERA.height, CAMERA.width, 3)
    assert abs(poster.astype(float) - rendered_picture).mean() < 4


def test_options_are_written_into_the_page(stream_file, tmp_path):
    options = ["--title", "A <b>", "--camera", "cam00", "--up", "-y", "--autoplay", "--loop"]
    json_output = run_json(
        "publish", stream_file, "-o", tmp_path / "site", *options, "--url", "https://example.org/s"
    )
    page = (tmp_path / "site" / "index.html").read_text("utf-8")

    assert "<title>A &lt;b&gt;</title>" in page
    assert 'camera="cam00" up="-y" autoplay loop>' in page
    assert 'content="https://example.org/s/poster.jpg"' in page
    assert 'src="https://example.org/s/" title="A &lt;b&gt;"' in json_output["iframe"]


def test_the_iframe_is_printed_on_one_line(stream_file, tmp_path):
    printed_lines = run("publish", stream_file, "-o", tmp_path / "site").stdout.splitlines()

    assert printed_lines[-1].startswith("<iframe ")
    assert printed_lines[-1].endswith("</iframe>")


def test_a_stream_of_a_pipe_is_published(small_stream, tmp_path):
    completed = run_piped("publish", "-", "-o", tmp_path / "site", data=small_stream.data)

    assert completed.returncode == 0, completed.stderr
    assert (tmp_path / "site" / "stream.quarc").read_bytes() == small_stream.data


def test_a_damaged_or_truncated_stream_is_not_published(stream_file, small_stream, tmp_path):
    offset = len(small_stream.data) - 60
    damaged_streams = [
        small_stream.data[:-1],
        small_stream.data[:offset]
        + bytes([small_stream.data[offset] ^ 1])
        + small_stream.data[offset + 1 :],
    ]
    for data in damaged_streams:
        stream_file.write_bytes(data)
        result = run("publish", stream_file, "-o", tmp_path / "site")

        assert result.exit_code == 1
        assert "the stream is rejected" in result.stderr
        assert not (tmp_path / "site").exists()


def test_an_unknown_camera_is_rejected_with_the_known_ones(stream_file, tmp_path):
    result = run("publish", stream_file, "-o", tmp_path / "site", "--camera", "cam99")

    assert result.exit_code == 2
    assert "no camera cam99; its cameras are cam00" in result.stderr
    assert not (tmp_path / "site").exists()


def test_a_stream_without_cameras_has_no_poster(tmp_path):
    stream_without_cameras = Path(__file__).parents[2] / "conformance" / "streams" / "births.quarc"
    result = run("publish", stream_without_cameras, "-o", tmp_path / "site", "--json")

    assert result.exit_code == 0
    assert '"poster": null' in result.stdout
    assert "the stream has no cameras" in result.stderr
    assert "<img" not in (tmp_path / "site" / "index.html").read_text("utf-8")


@pytest.mark.parametrize(
    "url",
    ["example.org", "ftp://example.org", "http://", "https:///a", "http://[::1", "http://a/?b=1"],
)
def test_an_invalid_url_is_rejected(url, stream_file, tmp_path):
    result = run("publish", stream_file, "-o", tmp_path / "site", "--url", url)

    assert result.exit_code == 2
    assert "--url" in result.stderr
    assert not (tmp_path / "site").exists()


def test_special_characters_in_the_name_of_the_folder_are_escaped(
    stream_file, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)  # so that the printed lines are short
    result = run("publish", stream_file, "-o", "50% #1?")

    assert '<iframe src="50%25%20%231%3F/"' in result.stdout
    assert "--directory '50% #1?'" in result.stdout


def test_a_folder_is_replaced_only_with_force(stream_file, tmp_path):
    first_run = run("publish", stream_file, "-o", tmp_path / "site")
    second_run = run("publish", stream_file, "-o", tmp_path / "site")
    forced_run = run("publish", stream_file, "-o", tmp_path / "site", "--force", "--title", "new")

    assert [result.exit_code for result in (first_run, second_run, forced_run)] == [0, 2, 0]
    assert "<title>new</title>" in (tmp_path / "site" / "index.html").read_text("utf-8")


def test_audio_is_copied_and_named_in_the_page(stream_file, tmp_path):
    (tmp_path / "my sound.x").write_bytes(make_wav())
    options = ["--audio", tmp_path / "my sound.x", "--audio-start", "-0.5"]
    json_output = run_json("publish", stream_file, "-o", tmp_path / "site", *options)
    page = (tmp_path / "site" / "index.html").read_text("utf-8")

    assert json_output["audio"] == "audio.wav"
    assert json_output["files"] == list_names(tmp_path / "site")
    assert (tmp_path / "site" / "audio.wav").read_bytes() == make_wav()
    assert 'audio="audio.wav" audio-start="-0.5">' in page


def test_the_sound_of_a_video_is_extracted(stream_file, tmp_path):
    write_video(tmp_path / "cam00.mp4", "aac")
    json_output = run_json(
        "publish", stream_file, "-o", tmp_path / "site", "--audio", tmp_path / "cam00.mp4"
    )

    assert json_output["audio"] == "audio.m4a"
    assert find_click((tmp_path / "site" / "audio.m4a").read_bytes())[0] == "aac"


def test_a_single_page_contains_the_audio(stream_file, tmp_path):
    (tmp_path / "a.wav").write_bytes(make_wav())
    json_output = run_json(
        "publish", stream_file, "-o", tmp_path / "page.html", "--audio", tmp_path / "a.wav"
    )

    assert (json_output["audio"], json_output["files"]) == (None, ["page.html"])
    assert _find_data((tmp_path / "page.html").read_text("utf-8"), "audio/wav") == make_wav()


def test_an_audio_file_that_is_too_large_for_a_single_page_is_rejected(
    stream_file, tmp_path, monkeypatch
):
    (tmp_path / "a.wav").write_bytes(make_wav(seconds=10))
    monkeypatch.setattr("quarc_ref.viewing.site.SINGLE_PAGE_LIMIT", 100_000)
    result = run(
        "publish", stream_file, "-o", tmp_path / "page.html", "--audio", tmp_path / "a.wav"
    )

    assert result.exit_code == 2
    assert "the audio file is larger" in result.stderr
    assert not (tmp_path / "page.html").exists()


def test_a_file_that_is_no_audio_and_a_start_without_audio_are_rejected(stream_file, tmp_path):
    write_video(tmp_path / "silent.mp4", None, seconds=1)
    for options, exit_code, message in [
        (["--audio", stream_file], 2, "is neither an audio file"),
        (["--audio", tmp_path / "missing.wav"], 2, "does not exist"),
        (["--audio", tmp_path / "silent.mp4"], 3, "has no sound"),
        (["--audio-start", 1], 2, "needs --audio"),
        (["--audio", stream_file, "--audio-start", "nan"], 2, "a number of seconds"),
    ]:
        result = run("publish", stream_file, "-o", tmp_path / "site", *options)

        assert result.exit_code == exit_code
        assert message in result.stderr
        assert not (tmp_path / "site").exists()
