import signal
import socket
import subprocess
import urllib.error
import urllib.request
import webbrowser
from contextlib import contextmanager
from pathlib import Path

import pytest

from quarc_ref.streams.chunk_reader import split_chunks
from quarc_ref.viewing.page import read_player
from quarc_ref.viewing.server import Server
from tests.cli.commands import read_json, run
from tests.cli.processes import SLOW_ENCODER, start
from tests.sound_files import make_wav


@contextmanager
def _open_viewer(*arguments, data=None, **pipes):
    """Start `view`, and yield the process and its JSON output; check that Ctrl-C ends it."""
    viewer = start(
        *("view", *arguments, "--no-open", "--port", 8700, "--json"),
        **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **pipes},
    )
    with viewer:
        try:
            if data is not None:
                viewer.stdin.write(data)
                viewer.stdin.flush()
            yield viewer, read_json(b"".join(viewer.stdout.readline() for _ in range(5)))
        finally:
            viewer.send_signal(signal.SIGINT)
            message = viewer.stderr.read()
        assert viewer.wait(60) == 128 + signal.SIGINT
        assert message == b"quarc-ref: stopped\n"


def _fetch(url, **headers):
    with urllib.request.urlopen(
        urllib.request.Request(url, headers=headers), timeout=60
    ) as response:
        return response.read()


def test_page_player_and_stream_are_served_until_ctrl_c(stream_file, small_stream):
    with _open_viewer(stream_file) as (_, json_output):
        url = json_output["url"]
        page = _fetch(url).decode()

        assert json_output["stream"] == "small.quarc"
        assert '<quarc-player src="stream.quarc" autoplay loop>' in page
        assert "<title>small</title>" in page
        assert _fetch(f"{url}quarc-player.js") == read_player()
        assert _fetch(f"{url}stream.quarc") == small_stream.data
        assert _fetch(f"{url}stream.quarc", Range="bytes=9-19") == small_stream.data[9:20]


def test_options_are_written_into_the_page(stream_file):
    options = ["--camera", "cam00", "--up", "-z", "--no-autoplay", "--no-loop", "--title", "Toys"]
    with _open_viewer(stream_file, *options) as (_, json_output):
        page = _fetch(json_output["url"]).decode()

    assert '<quarc-player src="stream.quarc" camera="cam00" up="-z">' in page
    assert "<title>Toys</title>" in page


def test_audio_is_served(stream_file, tmp_path):
    (tmp_path / "a.wav").write_bytes(make_wav())
    with _open_viewer(stream_file, "--audio", tmp_path / "a.wav", "--audio-start", 2) as (
        _,
        output,
    ):
        page = _fetch(output["url"]).decode()

        assert 'audio="audio.wav" audio-start="2.0">' in page
        assert _fetch(f"{output['url']}audio.wav", Range="bytes=4-9") == make_wav()[4:10]


def test_a_growing_stream_is_followed(tmp_path):
    path = tmp_path / "live.quarc"
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with start(path, program=SLOW_ENCODER, **pipes) as encoder:
        encoder.stdout.readline()
        with _open_viewer(path, "--follow") as (_, json_output):
            page, first_data = (_fetch(json_output["url"] + name) for name in ("", "stream.quarc"))
            encoder.stdin.write("\n")
            encoder.stdin.flush()
            added_data = _fetch(
                f"{json_output['url']}stream.quarc", Range=f"bytes={len(first_data)}-"
            )
            encoder.stdin.close()
            encoder.wait(60)
            remaining_data = _fetch(
                f"{json_output['url']}stream.quarc",
                Range=f"bytes={len(first_data + added_data)}-",
            )

    assert b" live>" in page
    assert first_data + added_data + remaining_data == path.read_bytes()


def test_a_stream_on_standard_input_plays_while_it_arrives(small_stream):
    half_bytes = list(split_chunks(small_stream.data))[-3].offset  # offset of the third-last chunk
    with _open_viewer("-", data=small_stream.data[:half_bytes], stdin=subprocess.PIPE) as (
        viewer,
        json_output,
    ):
        received_data, url = b"", f"{json_output['url']}stream.quarc"
        assert b" live>" in _fetch(json_output["url"])
        while len(received_data) < half_bytes:
            received_data += _fetch(url, Range=f"bytes={len(received_data)}-")
        viewer.stdin.write(small_stream.data[half_bytes:])
        viewer.stdin.close()
        while len(received_data) < len(small_stream.data):
            received_data += _fetch(url, Range=f"bytes={len(received_data)}-")

    assert received_data == small_stream.data


def test_for_a_stream_without_an_end_follow_is_suggested(tmp_path, small_stream):
    (tmp_path / "cut.quarc").write_bytes(small_stream.data[:-1])
    with start(
        "view",
        tmp_path / "cut.quarc",
        "--no-open",
        "--json",
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as viewer:
        message = viewer.stderr.readline()
        viewer.terminate()

    assert message.endswith(
        b"cut.quarc is incomplete (no TAIL chunk); use --follow to play a stream while it is "
        b"written\n"
    )
    assert viewer.returncode == 128 + signal.SIGTERM


def test_the_suggestion_to_follow_has_no_password_of_a_url(small_stream, monkeypatch):
    data = small_stream.data[:-1]
    monkeypatch.setattr(
        "quarc_ref.streams.http_source.HttpSource._fetch",
        lambda _, offset, length: (data[offset : offset + length], len(data)),
    )
    monkeypatch.setattr(Server, "serve_forever", lambda *_, **__: None)
    result = run("view", "https://me:secret@example.org/a.quarc?key=secret", "--no-open")

    assert "quarc-ref: a.quarc is incomplete" in result.stderr
    assert "secret" not in result.output


def test_a_stream_damaged_at_the_start_opens_no_page(stream_file, small_stream):
    stream_file.write_bytes(
        small_stream.data[:60] + bytes([small_stream.data[60] ^ 1]) + small_stream.data[61:]
    )
    result = run("view", stream_file, "--no-open")

    assert result.exit_code == 1
    assert result.stdout == ""


def test_an_unknown_camera_is_rejected_with_the_known_ones(stream_file):
    result = run("view", stream_file, "--no-open", "--camera", "cam99")

    assert result.exit_code == 2
    assert "no camera cam99; its cameras are cam00" in result.stderr


def test_a_stream_without_frames_opens_no_page():
    stream_without_frames = (
        Path(__file__).parents[2] / "conformance" / "streams" / "no-frames.quarc"
    )
    result = run("view", stream_without_frames, "--no-open")

    assert result.exit_code == 2
    assert "the stream has no frames" in result.stderr


def test_an_address_of_another_machine_is_a_failure_of_the_tool(stream_file):
    result = run("view", stream_file, "--no-open", "--host", "192.0.2.1")

    assert result.exit_code == 3
    assert result.stderr.startswith("quarc-ref: cannot listen on 192.0.2.1: ")
    assert len(result.stderr.splitlines()) == 1


def test_requests_for_an_allowed_host_name_are_answered(stream_file, small_stream):
    with _open_viewer(stream_file, "--allow-host", "viewer.example") as (_, json_output):
        url = f"{json_output['url']}stream.quarc"

        assert _fetch(url, Host="viewer.example") == small_stream.data
        with pytest.raises(urllib.error.HTTPError, match="403"):
            _fetch(url, Host="other.example")


@pytest.mark.parametrize("name", ["https://viewer.example", "viewer.example:80", ""])
def test_an_invalid_host_name_is_rejected(name, stream_file):
    result = run("view", stream_file, "--no-open", "--allow-host", name)

    assert result.exit_code == 2
    assert "--allow-host" in result.stderr


def test_the_page_is_opened_in_a_browser(stream_file, monkeypatch):
    opened_urls = []

    def open_page(url):
        opened_urls.append(url)
        raise KeyboardInterrupt

    monkeypatch.setattr(webbrowser, "open", open_page)
    result = run("view", stream_file, "--port", 8700)

    assert opened_urls[0] in result.stdout
    assert result.exit_code == 130


def test_a_page_on_all_interfaces_is_printed_with_its_public_address(stream_file, monkeypatch):
    monkeypatch.setattr(socket, "gethostname", lambda: "box.example")
    monkeypatch.setattr(Server, "serve_forever", lambda *_, **__: None)
    json_output = " ".join(
        run("view", stream_file, "--no-open", "--host", "0.0.0.0").stdout.split()
    )

    assert "page http://127.0.0.1:" in json_output
    assert "from other machines http://box.example:" in json_output
