from pathlib import Path

from quarc_ref.datasets.video import read_still
from quarc_ref.viewing.page import read_player
from tests.cli.commands import list_names, run, run_json
from tests.cli.processes import run_piped
from tests.small_streams import CAMERA


def test_a_folder_has_everything_that_a_page_needs(stream_file, tmp_path):
    site = tmp_path / "site"
    printed_output = run_json("publish", stream_file, "-o", site)

    names = ["index.html", "poster.jpg", "quarc-player.js", "stream.quarc"]
    assert printed_output["files"] == list_names(site) == names
    assert (site / "stream.quarc").read_bytes() == stream_file.read_bytes()
    assert (site / "quarc-player.js").read_bytes() == read_player()
    assert (printed_output["frames"], printed_output["bytes"]) == (4, stream_file.stat().st_size)
    assert printed_output["iframe"].startswith('<iframe src="site/" title="small" width="960"')


def test_the_poster_shows_the_view_of_the_camera(stream_file, tmp_path):
    run_json("publish", stream_file, "-o", tmp_path / "site")
    run_json("render", stream_file, "-o", tmp_path / "frame.png", "--frames", 0)
    poster, drawn = (read_still(tmp_path / name) for name in ("site/poster.jpg", "frame.png"))

    assert poster.shape == (CAMERA.height, CAMERA.width, 3)
    assert abs(poster.astype(float) - drawn).mean() < 4


def test_options_are_written_into_the_page(stream_file, tmp_path):
    options = ["--title", "A <b>", "--camera", "cam00", "--up", "-y", "--autoplay", "--loop"]
    printed_output = run_json(
        "publish", stream_file, "-o", tmp_path / "site", *options, "--url", "https://example.org/s"
    )
    page = (tmp_path / "site" / "index.html").read_text("utf-8")

    assert "<title>A &lt;b&gt;</title>" in page
    assert 'camera="cam00" up="-y" autoplay loop>' in page
    assert 'content="https://example.org/s/poster.jpg"' in page
    assert 'src="https://example.org/s/" title="A &lt;b&gt;"' in printed_output["iframe"]


def test_the_iframe_is_printed_on_one_line(stream_file, tmp_path):
    printed_output = run("publish", stream_file, "-o", tmp_path / "site").stdout.splitlines()

    assert printed_output[-1].startswith("<iframe ")
    assert printed_output[-1].endswith("</iframe>")


def test_a_stream_of_a_pipe_is_published(made, tmp_path):
    completed = run_piped("publish", "-", "-o", tmp_path / "site", data=made.data)

    assert completed.returncode == 0, completed.stderr
    assert (tmp_path / "site" / "stream.quarc").read_bytes() == made.data


def test_a_damaged_or_truncated_stream_is_not_published(stream_file, made, tmp_path):
    place = len(made.data) - 60
    damaged_data = [
        made.data[:-1],
        made.data[:place] + bytes([made.data[place] ^ 1]) + made.data[place + 1 :],
    ]
    for data in damaged_data:
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
    no_cameras = Path(__file__).parents[2] / "conformance" / "streams" / "births.quarc"
    result = run("publish", no_cameras, "-o", tmp_path / "site", "--json")

    assert result.exit_code == 0
    assert '"poster": null' in result.stdout
    assert "the stream has no cameras" in result.stderr
    assert "poster" not in (tmp_path / "site" / "index.html").read_text("utf-8")


def test_an_invalid_url_is_rejected(stream_file, tmp_path):
    result = run("publish", stream_file, "-o", tmp_path / "site", "--url", "example.org")

    assert result.exit_code == 2
    assert "--url" in result.stderr


def test_a_folder_is_replaced_only_with_force(stream_file, tmp_path):
    first = run("publish", stream_file, "-o", tmp_path / "site")
    second_run = run("publish", stream_file, "-o", tmp_path / "site")
    forced_run = run("publish", stream_file, "-o", tmp_path / "site", "--force", "--title", "new")

    assert [item.exit_code for item in (first, second_run, forced_run)] == [0, 2, 0]
    assert "<title>new</title>" in (tmp_path / "site" / "index.html").read_text("utf-8")
