"""Tests of streams on servers, and of the number of bytes that verbs read."""

from types import SimpleNamespace

import pytest

from quarc_ref.format.errors import SourceError
from quarc_ref.streams import FileSource, http_source
from quarc_ref.viewing.server import Server
from tests.cli.commands import run, run_json
from tests.small_streams import CountedSource, make_stream
from tests.streams.hostile_servers import serve


def test_for_a_range_of_frames_less_than_half_of_the_file_is_read(tmp_path, monkeypatch):
    data, _ = make_stream(gaussian_count=30, frame_count=60, canonical_every=20)
    (tmp_path / "long.quarc").write_bytes(data)
    source = CountedSource(data)
    monkeypatch.setattr(FileSource, "read", lambda _, offset, length: source.read(offset, length))

    json_output = run_json(
        "decode", tmp_path / "long.quarc", "-o", tmp_path / "out", "--frames", "40:41"
    )

    assert json_output["files"] == ["frame_0040.ply"]
    assert 0 < source.byte_count() < len(data) / 2


@pytest.mark.parametrize("verb", ["info", "inspect", "verify", "decode", "cut", "join"])
def test_an_unreadable_server_is_a_transport_error_and_not_a_fault_of_the_stream(
    verb, tmp_path, monkeypatch
):
    requests = []

    def fetch(source, offset, length):
        requests.append((source._url, offset, length))
        message = "the server does not support range requests"
        raise SourceError(message)

    monkeypatch.setattr("quarc_ref.streams.http_source.HttpSource._fetch", fetch)
    target = ["-o", tmp_path / "out"]
    extra_options = {"decode": target, "cut": ["--frames", ":", *target], "join": target}
    result = run(verb, "http://127.0.0.1:9/a.quarc", *extra_options.get(verb, []))

    assert requests[0][0] == "http://127.0.0.1:9/a.quarc"
    assert result.exit_code == 3
    assert result.stderr == "quarc-ref: the server does not support range requests\n"
    assert result.stdout == ""
    assert [*tmp_path.iterdir()] == []


def test_a_stream_on_a_server_is_named_after_its_file(tmp_path, monkeypatch):
    data, _ = make_stream(gaussian_count=5, frame_count=1)
    monkeypatch.setattr(
        "quarc_ref.streams.http_source.HttpSource._fetch",
        lambda _, offset, length: (data[offset : offset + length], len(data)),
    )
    url = "https://example.org/streams/a.quarc"

    assert run("info", url).stdout.startswith("a.quarc")
    assert run("info", url.replace("https", "HTTPS")).stdout.startswith("a.quarc")
    signed_url = "https://example.org/streams/my%20a.quarc?signature=secret/1#part"
    assert run("info", signed_url).stdout.splitlines()[0] == "my a.quarc"
    assert run("info", "https://me:secret@example.org").stdout.splitlines()[0] == "example.org"
    run("publish", signed_url, "-o", tmp_path / "site")
    assert "<title>my a</title>" in (tmp_path / "site" / "index.html").read_text("utf-8")
    assert "secret" not in (tmp_path / "site" / "index.html").read_text("utf-8")
    assert run_json("verify", url)["frames"] == 1
    assert run_json("cut", url, "--frames", ":", "-o", tmp_path / "b.quarc")["frames"] == 1
    assert (tmp_path / "b.quarc").read_bytes() == data


@pytest.mark.parametrize("verb", ["decode", "verify", "view"])
def test_follow_outlasts_a_restart_of_the_server(verb, tmp_path, monkeypatch):
    def answer(request):
        is_down = 3 <= request.number < 20
        request.send("HTTP/1.1 503 Down\n\n") if is_down else request.answer()

    pauses = []
    clock = SimpleNamespace(monotonic=lambda: sum(pauses), sleep=pauses.append)
    monkeypatch.setattr(http_source, "time", clock)
    monkeypatch.setattr(Server, "serve_forever", lambda *_, **__: None)
    options = {"decode": ["-o", tmp_path / "out"], "view": ["--no-open"]}.get(verb, [])
    with serve(answer) as server:
        result = run(verb, server.url, *options)
        server.request_heads.clear()
        following = run(verb, server.url, *options, "--follow", "--patience", 600)

    assert (result.exit_code, following.exit_code) == (3, 0)
    assert result.stderr == f"quarc-ref: the server of {server.url} answers 503 Down\n"
