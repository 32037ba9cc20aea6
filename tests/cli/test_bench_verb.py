import re
from pathlib import Path

from quarc_ref.inspection import decode_speed
from quarc_ref.inspection.decode_speed import Speed
from tests.cli.commands import run, run_json
from tests.small_streams import make_stream

_SEEDS = Path(__file__).parents[1] / "hostile" / "seeds"


def test_a_stream_is_measured_by_bench(tmp_path):
    path = tmp_path / "a.quarc"
    path.write_bytes(make_stream()[0])

    json_output = run_json("bench", path, "--threads", 1, "--quiet")

    assert json_output["frames"] == 4
    measured_keys = {
        "fps",
        "cpu_ms",
        "stolen_share",
        "ms_by_stage",
        "peak_rss_mib",
        "first_frame_s",
    }
    assert measured_keys <= json_output.keys()
    assert ", 1 thread, " in run("bench", path, "--threads", 1).stdout


def test_measured_speeds_are_printed_with_their_units(tmp_path, monkeypatch):
    speed = Speed(
        4, 1600, 2, "fast", fps=123.44, cpu_ms=8.06, stolen_share=0.25,
        ms_by_stage={"decode": 2.004}, first_frame_s=0.5, warm_first_frame_s=0.125,
        peak_rss_mib=64.4,
    )  # fmt: skip
    monkeypatch.setattr(decode_speed, "measure_speed", lambda *_: speed)
    (tmp_path / "a.quarc").touch()
    text = " ".join(run("bench", tmp_path / "a.quarc").stdout.split())

    assert text == (
        "a.quarc frames 4, the last with 1,600 Gaussians "
        "first frame 0.50 s after opening, 0.12 s with all code loaded peak memory 64 MiB "
        "frames per second 123.4, 2 threads, fast engine "
        "processor 8.1 ms per frame, all threads together; "
        "25% of the CPU time was taken by the host ms: decode 2.00"
    )


def test_a_stream_of_one_frame_has_no_speed(tmp_path):
    path, cut_path = tmp_path / "a.quarc", tmp_path / "first.quarc"
    path.write_bytes(make_stream()[0])
    run("cut", path, "--frames", 0, "-o", cut_path)

    output = run("bench", cut_path).stdout

    assert "unknown, because the first frame is not counted" in output
    assert "processor" not in output


def test_a_single_gaussian_is_in_the_singular():
    output = run("bench", _SEEDS / "streams" / "snapshot.quarc").stdout

    assert re.search("the last with 1 Gaussian *\n", output)


def test_a_bad_stream_is_rejected(tmp_path):
    path = tmp_path / "a.quarc"
    path.write_bytes(make_stream()[0][:-60])

    result = run("bench", path)

    assert result.exit_code == 1
    assert "rejected" in result.stderr
