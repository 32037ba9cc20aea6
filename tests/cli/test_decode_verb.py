import sys
from pathlib import Path

import numpy as np
import pytest

from quarc_ref.cli import output
from quarc_ref.decoder import dequantize
from quarc_ref.export.arrays_npz import build_npz
from quarc_ref.export.bake_filter import bake_filter
from quarc_ref.export.gaussian_ply import build_ply
from tests.cli.commands import list_names, make_folder, read_json, run, run_json
from tests.small_streams import CAMERA, make_stream


@pytest.mark.parametrize("kind", ["ply", "npz"])
def test_decode_writes_the_output_of_the_exporters_for_every_frame(
    kind, stream_file, small_stream, tmp_path
):
    json_output = run_json("decode", stream_file, "-o", tmp_path / "out", "--to", kind)

    names = [f"frame_{frame:04}.{kind}" for frame in range(4)]
    sidecar = "sequence.json"
    assert json_output == {"folder": str(tmp_path / "out"), "files": names, "sidecar": sidecar}
    assert list_names(tmp_path / "out") == names
    for name, state in zip(names, small_stream.states, strict=True):
        splats = dequantize(state.scene)
        expected_data = build_ply(splats) if kind == "ply" else build_npz(state.scene, splats)
        assert (tmp_path / "out" / name).read_bytes() == expected_data


def test_the_low_pass_filter_of_the_capture_is_baked_on_request(
    stream_file, small_stream, tmp_path
):
    run_json("decode", stream_file, "-o", tmp_path / "a.ply", "--frames", "2", "--bake-filter")

    splats = bake_filter(dequantize(small_stream.states[2].scene), [CAMERA])
    assert (tmp_path / "a.ply").read_bytes() == build_ply(splats)


def test_without_cameras_the_filter_is_unknown(tmp_path):
    stream = Path(__file__).parents[2] / "conformance" / "streams" / "births-and-deaths.quarc"
    result = run("decode", stream, "-o", tmp_path / "out", "--bake-filter")

    assert result.exit_code == 2
    assert "--bake-filter needs the cameras of the capture" in result.stderr
    assert list_names(tmp_path) == []


@pytest.mark.parametrize(
    ("frames", "expected_frames"),
    [(":", [0, 1, 2, 3]), ("2:", [2, 3]), (":1", [0]), ("1:3", [1, 2]), ("3:99", [3]), ("0", [0])],
)
def test_a_range_of_frames_is_decoded_alone(frames, expected_frames, stream_file, tmp_path):
    json_output = run_json("decode", stream_file, "-o", tmp_path / "out", "--frames", frames)

    assert json_output["files"] == [f"frame_{frame:04}.ply" for frame in expected_frames]
    assert list_names(tmp_path / "out") == json_output["files"]


def test_the_frames_of_a_cut_stream_are_named_if_none_is_requested(tmp_path):
    data, _ = make_stream(gaussian_count=12, frame_count=6, canonical_every=3)
    whole, part = tmp_path / "whole.quarc", tmp_path / "part.quarc"
    whole.write_bytes(data)
    run("cut", whole, "--frames", "3:", "-o", part)
    for frames in (":3", "6:"):
        result = run("decode", part, "-o", tmp_path / "out", "--frames", frames)

        assert result.exit_code == 2
        assert result.stderr.endswith(
            f"quarc-ref: the stream has none of the frames that --frames {frames} selects; it has "
            "3 frames from 3 on\n"
        )


@pytest.mark.parametrize("frames", ["4:", "9:12", "3:1", "2:2", "a:b", "4", "", "-1:2", "1:2:3"])
def test_an_empty_range_writes_nothing(frames, stream_file, tmp_path):
    result = run("decode", stream_file, "-o", tmp_path / "out", "--frames", frames)

    assert result.exit_code == 2
    assert result.stderr
    assert list_names(tmp_path) == ["small.quarc"]


def test_a_growing_stream_gives_the_requested_frames(stream_file, small_stream, tmp_path):
    stream_file.write_bytes(small_stream.data[:-60])
    json_output = run_json("decode", stream_file, "-o", tmp_path / "out", "--frames", "0:2")

    assert json_output["files"] == ["frame_0000.ply", "frame_0001.ply"]


def test_a_single_file_has_the_given_name(stream_file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run("decode", stream_file, "-o", "one.ply", "--frames", "0")

    assert [line.split() for line in result.stdout.splitlines()] == [
        ["one.ply"],
        ["files", "1,", "one.ply"],
    ]


def test_a_damaged_stream_leaves_no_folder_behind_and_keeps_the_old_one(
    stream_file, small_stream, tmp_path
):
    make_folder(tmp_path / "out", "frame_0000.ply")
    stream_file.write_bytes(small_stream.data[:-1])

    assert run("decode", stream_file, "-o", tmp_path / "new").exit_code == 1
    assert run("decode", stream_file, "-o", tmp_path / "out", "--force").exit_code == 1
    assert list_names(tmp_path) == ["out", "small.quarc"]
    assert (tmp_path / "out" / "frame_0000.ply").read_text() == "old"


def test_frames_of_another_decode_are_replaced_only_on_request(stream_file, tmp_path):
    command = ["decode", stream_file, "-o", tmp_path / "out"]
    assert run(*command).exit_code == 0

    rejected_run = run(*command, "--frames", "1:2")
    names_after_rejection = list_names(tmp_path / "out")
    forced_run = run(*command, "--frames", "1:2", "--to", "npz", "--force")

    assert rejected_run.exit_code == 2
    assert "--force" in rejected_run.stderr
    assert len(names_after_rejection) == 4
    assert forced_run.exit_code == 0
    assert list_names(tmp_path / "out") == ["frame_0001.npz"]


def test_decoded_arrays_are_those_of_the_scene(stream_file, small_stream, tmp_path):
    run("decode", stream_file, "-o", tmp_path / "out", "--to", "npz", "--frames", "3:4")

    with np.load(tmp_path / "out" / "frame_0003.npz", allow_pickle=False) as arrays:
        assert np.array_equal(arrays["state_positions"], small_stream.states[3].scene.positions)


@pytest.mark.parametrize(("options", "total_text"), [([], "/4"), (["--follow"], "")])
def test_progress_counts_frames_even_if_their_number_is_unknown(
    options, total_text, stream_file, tmp_path, monkeypatch
):
    monkeypatch.setattr(output, "_SECONDS_BETWEEN_LINES", 0.0)

    messages = run("decode", stream_file, "-o", tmp_path / "out", *options).stderr

    assert messages.splitlines() == [f"decode {frame}{total_text}" for frame in range(1, 5)]


def test_the_sidecar_has_rate_axes_and_cameras_as_in_its_schema(stream_file, tmp_path):
    run("decode", stream_file, "-o", tmp_path / "out", "--frames", "2:")
    sidecar = read_json((tmp_path / "out" / "sequence.json").read_text())

    assert sidecar["files"].format(frame=2) == "frame_0002.ply"
    assert (sidecar["first_frame"], sidecar["frames_per_second"]) == (2, 30)
    assert (sidecar["up"], sidecar["up_is_known"]) == ("-y", False)
    assert [camera["name"] for camera in sidecar["cameras"]] == ["cam00"]


def test_all_frames_go_into_one_file_if_the_format_allows_it(stream_file, tmp_path):
    pytest.importorskip("fourdgs")
    folder_output = run_json("decode", stream_file, "-o", tmp_path / "out", "--to", "4dgs")
    file_output = run_json("decode", stream_file, "-o", tmp_path / "all.4dgs")

    assert folder_output["files"] == ["frames.4dgs"]
    assert file_output == {"folder": str(tmp_path), "files": ["all.4dgs"], "sidecar": None}
    file_in_folder = tmp_path / "out" / "frames.4dgs"
    assert file_in_folder.read_bytes() == (tmp_path / "all.4dgs").read_bytes()


def test_a_missing_library_is_named_with_the_extra_that_installs_it(
    stream_file, tmp_path, monkeypatch
):
    monkeypatch.setitem(sys.modules, "gaussforge", None)
    result = run("decode", stream_file, "-o", tmp_path / "out", "--to", "spz")

    assert result.exit_code == 3
    assert ".[export]" in result.stderr
    assert list_names(tmp_path) == ["small.quarc"]


def test_a_suffix_of_no_format_makes_a_folder_only_if_the_format_is_given(stream_file, tmp_path):
    folder = tmp_path / "frames.v2"
    unclear_run = run("decode", stream_file, "-o", folder)
    first_run = run("decode", stream_file, "-o", folder, "--to", "ply")
    second_run = run("decode", stream_file, "-o", folder, "--force")

    assert unclear_run.exit_code == 2
    assert f"not clear from the name {folder}: use one of the suffixes ply" in unclear_run.stderr
    assert (first_run.exit_code, second_run.exit_code) == (0, 0)
    assert (folder / "frame_0000.ply").is_file()


def test_digits_after_a_point_are_no_suffix(stream_file, tmp_path):
    assert run("decode", stream_file, "-o", tmp_path / "steak_0.5").exit_code == 0
    assert (tmp_path / "steak_0.5" / "frame_0000.ply").is_file()


def test_an_unknown_format_is_rejected_with_the_known_ones(stream_file, tmp_path):
    result = run("decode", stream_file, "-o", tmp_path / "out", "--to", "obj")

    assert result.exit_code == 2
    assert "4dgs" in result.stderr
