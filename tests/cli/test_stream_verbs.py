import io
import re
from pathlib import Path

import pytest

from quarc_ref.cli import output
from quarc_ref.decoder import compute_digest
from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.format.records import StreamHeader
from tests.cli.commands import list_names, run, run_json
from tests.small_streams import CAMERA, make_gaussians, make_stream


def _write_stream(path, metadata, frames=1, **header_fields):
    sink, header = io.BytesIO(), StreamHeader(**header_fields)
    loop = ClosedLoop(sink, header, (CAMERA,), metadata)
    if frames:
        loop.commit_canonical(make_gaussians(header, 5), frame=0)
    loop.finish()
    path.write_bytes(sink.getvalue())


def test_info_gives_every_figure_as_json(stream_file, small_stream):
    json_output = run_json("info", stream_file)

    assert json_output["format_version"] == "1.0"
    assert json_output["frames"] == 4
    assert json_output["gaussians"] == small_stream.states[-1].scene.count
    assert json_output["anchors"] == max(
        sum(level.shape[1] for level in state.symbols) for state in small_stream.states
    )
    assert json_output["bytes"].keys() == {
        *("total", "canonical", "snapshots", "motion", "updates", "births", "overhead")
    }
    assert json_output["kb_per_frame"].keys() == {"without_canonical", "with_canonical"}
    assert json_output["estimate_bytes"].keys() == {
        *("canonical", "snapshots", "motion", "updates", "births")
    }
    assert json_output["state_sha256"] == compute_digest(small_stream.states[-1].scene)


@pytest.mark.parametrize("feature", ["updates", "snapshots"])
def test_info_names_the_version_that_has_the_features_of_the_stream(tmp_path, feature):
    path = tmp_path / "new.quarc"
    _write_stream(path, {}, **{feature: True})

    assert run_json("info", path)["format_version"] == "1.1"
    assert re.search(r"format +1\.1, conformance level 1\.0 ", run("info", path).stdout)


def test_info_states_that_a_stream_has_no_cameras():
    vectors = Path(__file__).parents[2] / "conformance" / "streams"

    assert re.search(r"cameras +none", run("info", vectors / "no-frames.quarc").stdout)


def test_a_mean_over_no_frames_is_not_printed(tmp_path):
    _write_stream(tmp_path / "still.quarc", {})

    text = run("info", tmp_path / "still.quarc").stdout

    assert "for the whole stream" in text
    assert "without keyframes" not in text


def test_the_kinds_of_bytes_add_up_to_the_file(stream_file):
    sizes = run_json("info", stream_file)["bytes"]

    assert sizes["total"] == stream_file.stat().st_size
    assert sum(sizes.values()) == 2 * sizes["total"]
    assert (sizes.pop("updates"), sizes.pop("snapshots")) == (0, 0)
    assert min(sizes.values()) > 0


def test_info_prints_the_same_figures_as_text(stream_file):
    json_output, text = run_json("info", stream_file), run("info", stream_file).stdout

    for kind in ("canonical", "motion", "births"):
        size, estimate = json_output["bytes"][kind], json_output["estimate_bytes"][kind]
        assert re.search(
            rf"^{kind} +{size:,} bytes \(zero-order estimate {estimate:,}\)", text, re.M
        )
    kilobytes = json_output["kb_per_frame"]
    assert f"{kilobytes['without_canonical']:.2f} without keyframes" in text
    assert f"{kilobytes['with_canonical']:.2f} for the whole stream" in text
    assert "cam00 (held out)" in text
    assert "made by hand" in text


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({}, "right-handed, up unknown, unknown meters per unit"),
        ({"up_axis": 3, "meters_per_unit": 0.5}, "right-handed, up +y, 0.5 meters per unit"),
        ({"up_axis": 6, "right_handed": False}, "left-handed, up -z, unknown meters per unit"),
        ({"meters_per_unit": 0.01}, "right-handed, up unknown, 0.01 meters per unit"),
    ],
)
def test_info_states_the_axes_and_the_scale(fields, expected, tmp_path):
    _write_stream(tmp_path / "a.quarc", {}, **fields)

    assert expected in run("info", tmp_path / "a.quarc").stdout


def test_json_also_states_the_world_the_anchors_and_the_first_frame(tmp_path):
    header = {"up_axis": 4, "right_handed": False, "meters_per_unit": 0.5, "level_count": 2}
    _write_stream(tmp_path / "a.quarc", {}, sh_degree=1, resample_interval=3, **header)

    json_output = run_json("info", tmp_path / "a.quarc")

    world = {key: json_output[key] for key in ("right_handed", "up", "meters_per_unit")}
    assert world == {"right_handed": False, "up": "-y", "meters_per_unit": 0.5}
    assert json_output["sh_degree"] == 1
    assert (json_output["anchor_levels"], json_output["resample_interval"]) == (2, 3)
    assert json_output["first_frame"] == 0


def test_json_has_null_for_what_a_stream_does_not_state(tmp_path):
    _write_stream(tmp_path / "empty.quarc", {}, frames=0)

    json_output = run_json("info", tmp_path / "empty.quarc")

    assert [json_output[key] for key in ("first_frame", "up", "meters_per_unit")] == [None] * 3


def test_metadata_is_printed_unchanged_and_hides_nothing(tmp_path):
    metadata = {"[red]": "[/nonsense] :smile:", "steer": "\x1b[2J", "frames": "999"}
    _write_stream(tmp_path / "odd.quarc", metadata)

    text = run("info", tmp_path / "odd.quarc").stdout

    assert "[red]" in text
    assert "[/nonsense] :smile:" in text
    assert "\\x1b[2J" in text
    assert "\x1b" not in text
    assert "999" not in text


def test_a_stream_without_frames_is_valid(tmp_path):
    _write_stream(tmp_path / "empty.quarc", {}, frames=0)

    assert run_json("info", tmp_path / "empty.quarc")["gaussians"] == 0
    assert run("info", tmp_path / "empty.quarc").exit_code == 0
    assert run_json("verify", tmp_path / "empty.quarc")["frames"] == 0
    assert "None" not in run("verify", tmp_path / "empty.quarc").stdout


def test_info_states_the_frames_of_a_cut_stream(tmp_path):
    (tmp_path / "a.quarc").write_bytes(make_stream(frame_count=6, canonical_every=3)[0])
    run("cut", tmp_path / "a.quarc", "--frames", "3:6", "-o", tmp_path / "cut.quarc")

    run("cut", tmp_path / "a.quarc", "--frames", "3", "-o", tmp_path / "one.quarc")

    assert "3, 3 to 5, at" in run("info", tmp_path / "cut.quarc").stdout
    assert "1, frame 3, at" in run("info", tmp_path / "one.quarc").stdout
    assert run_json("info", tmp_path / "cut.quarc")["first_frame"] == 3
    assert "  6 at" in run("info", tmp_path / "a.quarc").stdout


def test_verify_prints_the_crc_of_the_last_state(stream_file, small_stream):
    digest = compute_digest(small_stream.states[-1].scene)

    assert run_json("verify", stream_file) == {"valid": True, "frames": 4, "state_sha256": digest}
    assert digest in run("verify", stream_file).stdout


def test_verify_names_the_fault_and_the_frames_before_it(stream_file, small_stream):
    stream_file.write_bytes(small_stream.data[:-1])
    result = run("verify", stream_file, "--json")

    assert result.exit_code == 1
    assert '"refused": "truncated"' in result.stdout
    assert '"frames": 4' in result.stdout
    assert result.stderr.startswith("quarc-ref: the stream is rejected: truncated at byte ")


@pytest.mark.parametrize("verb", ["info", "verify", "decode", "eval"])
def test_a_file_that_is_not_a_stream_is_rejected_by_every_verb(verb, tmp_path):
    (tmp_path / "text.quarc").write_text("no stream at all")
    extra_options = {"decode": ["-o", tmp_path / "out"], "eval": [tmp_path]}
    result = run(verb, tmp_path / "text.quarc", *extra_options.get(verb, []))

    assert result.exit_code == 1
    assert "bad-magic" in result.stderr
    assert result.stdout == ""
    assert list_names(tmp_path) == ["text.quarc"]


@pytest.mark.parametrize("verb", ["info", "verify", "decode", "eval"])
def test_a_missing_file_is_a_usage_error(verb, tmp_path):
    extra_options = {"decode": ["-o", tmp_path / "out"], "eval": [tmp_path]}

    assert run(verb, tmp_path / "none.quarc", *extra_options.get(verb, [])).exit_code == 2
    assert run(verb, tmp_path, *extra_options.get(verb, [])).exit_code == 2


def test_progress_goes_to_stderr_unless_quiet(stream_file, monkeypatch):
    monkeypatch.setattr(output, "_SECONDS_BETWEEN_LINES", 0.0)

    verbose_run, quiet_run = (
        run("verify", stream_file, "--json"),
        run("verify", stream_file, "--json", "-q"),
    )

    assert verbose_run.stderr.splitlines() == [f"decode {frame}/4" for frame in range(1, 5)]
    assert quiet_run.stderr == ""
    assert verbose_run.stdout == quiet_run.stdout
