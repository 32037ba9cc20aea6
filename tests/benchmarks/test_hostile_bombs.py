import json
import subprocess
import sys

import pytest

import hostile_bombs
from quarc_ref.format.constants import LEVELS, Level
from quarc_ref.streams import decode
from tests.engines import needs_fast


@pytest.fixture
def _small_level(monkeypatch):
    monkeypatch.setitem(LEVELS, 10, Level(gaussians=400, births=20, chunk_bytes=1 << 20))


@pytest.mark.usefixtures("_small_level")
@pytest.mark.parametrize("has_births", [False, True])
@pytest.mark.parametrize("arrangement", hostile_bombs._ARRANGEMENTS)
def test_a_bomb_uses_the_limits_of_its_level_and_is_small(arrangement, has_births):
    data = hostile_bombs.build_stream(10, arrangement, has_births=has_births)
    counts = [scene.count for scene in decode(data)]

    assert len(counts) == 4
    assert counts[-1] == 400
    assert counts[0] == (340 if has_births else 400)
    assert len(data) < 12 * 400


@needs_fast
def test_a_stream_is_measured_in_its_own_process():
    command = [
        sys.executable,
        hostile_bombs.__file__,
        "--measure",
        str(hostile_bombs._WARM_UP_STREAM),
    ]
    measurement = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)

    assert measurement.keys() == {"slowest_frame_s", "peak_rss_mib"}
    assert 10 < measurement["peak_rss_mib"] < 2000


def test_the_table_has_a_header(monkeypatch, capsys):
    row = {"stream": "10 on a sphere", "bytes": 9, "slowest_frame_s": 0.1, "peak_rss_mib": 50}
    monkeypatch.setattr(hostile_bombs, "_measure_streams", lambda *_: [row])
    monkeypatch.setattr(sys, "argv", ["hostile_bombs.py", "--engine", "reference"])

    hostile_bombs.main()

    lines = capsys.readouterr().out.splitlines()
    assert lines[1:] == ["| --- | --- | --- | --- |", "| 10 on a sphere | 9 | 0.1 | 50 |"]
