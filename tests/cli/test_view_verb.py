import signal
import subprocess
import urllib.request

import pytest

from tests.cli.commands import read_json, run
from tests.cli.processes import start
from tests.small_streams import make_stream

pytest.importorskip("viser")


_WITHOUT_CORE = """
import sys
sys.modules["quarc_core"] = None
from quarc_ref.cli.app import main
main()
"""


def _end(process):
    process.send_signal(signal.SIGINT)
    return process.wait(60)


def test_a_page_is_served_until_it_is_interrupted(stream_file):
    viewer = start(
        *("view", stream_file, "--no-open", "--port", 8700, "--json"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    printed = read_json("".join(viewer.stdout.readline() for _ in range(5)))
    with urllib.request.urlopen(printed["url"], timeout=60) as answer:
        status = answer.status

    assert status == 200
    assert printed["stream"] == "small.quarc"
    assert _end(viewer) == 0
    assert viewer.stderr.read() == ""
    assert viewer.stdout.read() == ""
    viewer.stdout.close()
    viewer.stderr.close()


def test_a_missing_fast_engine_is_told(tmp_path):
    path = tmp_path / "large.quarc"
    path.write_bytes(make_stream(gaussian_count=9000, frame_count=1)[0])
    with start(
        *("view", path, "--no-open", "--port", 8750, "--json"),
        program=_WITHOUT_CORE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as viewer:
        told = viewer.stderr.readline()
        code = _end(viewer)

    assert "quarc_core is not installed" in told
    assert code == 0


def test_a_damaged_stream_opens_no_page(stream_file, made):
    stream_file.write_bytes(made.data[:200] + bytes([made.data[200] ^ 1]) + made.data[201:])
    result = run("view", stream_file, "--no-open")

    assert result.exit_code == 1
    assert result.stdout == ""


def test_an_address_of_another_machine_is_the_tools_failure(stream_file):
    result = run("view", stream_file, "--no-open", "--host", "192.0.2.1")

    assert result.exit_code == 3
    assert result.stderr.startswith("quarc-ref: 192.0.2.1 cannot be listened at: ")
    assert len(result.stderr.splitlines()) == 1


def test_help_says_what_the_page_does_not_show_exactly():
    assert "one color" in " ".join(run("view", "-h").stdout.split())


@pytest.mark.parametrize("name", ["https://viewer.example", "viewer.example:80", ""])
def test_what_is_no_name_of_a_host_is_rejected(name, stream_file):
    result = run("view", stream_file, "--no-open", "--allow-host", name)

    assert result.exit_code == 2
    assert "--allow-host" in result.stderr
