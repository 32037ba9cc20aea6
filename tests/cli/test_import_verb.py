"""Tests of `import`, which encodes frames of other formats."""

import json

import pytest

from quarc_ref.encoder.scenes.bounds import PROFILES
from quarc_ref.export.clip import Frame
from quarc_ref.export.gaussian_ply import build_ply
from quarc_ref.streams import decode
from quarc_ref.streams.prologue import read_prologue
from quarc_ref.streams.source import BytesSource
from tests.cli.commands import list_names, read_json, run, run_json
from tests.encoder.scenes.given import make_splats


@pytest.fixture
def folder(stream_file, tmp_path):
    """A folder with PLY files and a sidecar that `decode` wrote for a small stream."""
    assert run("decode", stream_file, "-o", tmp_path / "plys").exit_code == 0
    return tmp_path / "plys"


def test_import_reads_the_output_of_decode(folder, tmp_path, small_stream):
    json_output = run_json("import", folder, "-o", tmp_path / "again.quarc")
    data = (tmp_path / "again.quarc").read_bytes()

    assert (json_output["frames"], json_output["bytes"]) == (4, len(data))
    assert [scene.count for scene in decode(data)] == [
        state.scene.count for state in small_stream.states
    ]
    cameras, metadata = read_prologue(BytesSource(data))
    assert [camera.name for camera in cameras] == ["cam00"]
    assert metadata["bounds"].startswith("position=")
    for name, error in json_output["errors"].items():
        assert error <= json_output["bounds"][name] * 1.001


def test_settings_of_another_encode_are_not_imported(folder, tmp_path):
    sidecar = json.loads((folder / "sequence.json").read_text("utf-8"))
    sidecar["metadata"] = {"capture": "room", "settings": "motion.lr=0.001"}
    (folder / "sequence.json").write_text(json.dumps(sidecar))
    run_json("import", folder, "-o", tmp_path / "again.quarc")

    _, metadata = read_prologue(BytesSource((tmp_path / "again.quarc").read_bytes()))
    assert metadata["capture"] == "room"
    assert "settings" not in metadata


def test_frames_whose_gaussians_are_new_are_reported(tmp_path):
    for frame in range(4):  # frames 1 and 3 have the Gaussians of the frame before
        ply = build_ply(make_splats(40, seed=frame // 2))
        (tmp_path / f"{frame}.ply").write_bytes(ply)
    result = run("import", tmp_path, "-o", tmp_path / "a.quarc", "--json")
    planned = run("import", tmp_path, "-o", tmp_path / "b.quarc", "--keyframe-interval", "2")

    assert read_json(result.stdout)["unplanned_keyframes"] == 1
    assert "1 of 4 frames became keyframes" in result.stderr
    assert "became keyframes" not in planned.stderr


def test_frames_keep_their_ordinals(stream_file, tmp_path):
    run("decode", stream_file, "-o", tmp_path / "plys", "--frames", "2:")
    run_json("import", tmp_path / "plys", "-o", tmp_path / "again.quarc")

    data = (tmp_path / "again.quarc").read_bytes()
    assert [scene.frame for scene in decode(data)] == [2, 3]


def test_file_numbers_that_are_not_those_of_the_frames_are_reported(folder, tmp_path):
    complete_run = run("import", folder, "-o", tmp_path / "complete.quarc")
    (folder / "frame_0001.ply").unlink()
    result = run("import", folder, "-o", tmp_path / "a.quarc")

    assert (complete_run.exit_code, result.exit_code) == (0, 0)
    assert "numbers of the files" not in complete_run.stderr
    assert "files (0 to 3) differ from those of the frames (0 to 2)" in result.stderr
    assert "there is no file between 0 and 2, so all later frames are shown too" in result.stderr


def test_missing_files_are_reported_with_quiet_and_json_too(folder, tmp_path):
    (folder / "frame_0002.ply").unlink()
    result = run("import", folder, "-o", tmp_path / "a.quarc", "--quiet", "--json")

    assert result.exit_code == 0
    assert "there is no file between 1 and 3" in result.stderr


def test_numbers_in_equal_steps_have_no_gap(folder, tmp_path):
    for number in (1, 3):
        (folder / f"frame_000{number}.ply").unlink()
    result = run("import", folder, "-o", tmp_path / "a.quarc")

    assert "numbers of the files (0 to 2) differ" in result.stderr
    assert "there is no file" not in result.stderr


def test_a_4dgs_file_keeps_the_ordinals_and_cameras_in_its_folder(stream_file, tmp_path):
    pytest.importorskip("fourdgs")
    run("decode", stream_file, "-o", tmp_path / "in", "--to", "4dgs", "--frames", "2:")
    run_json("import", tmp_path / "in" / "frames.4dgs", "-o", tmp_path / "again.quarc")
    (tmp_path / "in" / "frames.4dgs").rename(tmp_path / "in" / "other.4dgs")
    run_json("import", tmp_path / "in" / "other.4dgs", "-o", tmp_path / "other.quarc")

    again, other = ((tmp_path / name).read_bytes() for name in ("again.quarc", "other.quarc"))
    assert [scene.frame for scene in decode(again)] == [2, 3]
    assert [camera.name for camera in read_prologue(BytesSource(again))[0]] == ["cam00"]
    assert [scene.frame for scene in decode(other)] == [0, 1]
    assert not read_prologue(BytesSource(other))[0]


def test_profile_bounds_rate_axes_and_canonical_frames_can_be_set(folder, tmp_path):
    options = ["--profile", "coarse", "--bound", "position=0.001", "--bound", "rotation=0.03"]
    options += ["--fps", 24, "--up", "+z", "--keyframe-interval", 2]
    json_output = run_json("import", folder, "-o", tmp_path / "a.quarc", *options)
    scenes = list(decode((tmp_path / "a.quarc").read_bytes()))

    assert json_output["bounds"]["position"] == 0.001
    assert json_output["bounds"]["rotation"] == 0.03
    assert json_output["bounds"]["sh_dc"] == PROFILES["coarse"].sh_dc != PROFILES["fine"].sh_dc
    assert scenes[0].header.frames_per_second == 24
    assert scenes[0].header.up_axis == 5
    assert [scene.phase for scene in scenes] == [0, 1, 0, 1]


def test_one_file_is_one_frame(small_stream, tmp_path):
    ply_file = tmp_path / "one.ply"
    ply_file.write_bytes(build_ply(Frame.from_scene(small_stream.states[0].scene).splats))

    assert run_json("import", ply_file, "-o", tmp_path / "a.quarc")["frames"] == 1


@pytest.mark.parametrize(
    ("sh_degrees", "dropped_degree"), [((1, 1), 0), ((1, 2), 2), ((0, 1), 1), ((0, 3), 3)]
)
def test_dropped_sh_degrees_are_reported(sh_degrees, dropped_degree, tmp_path):
    (tmp_path / "plys").mkdir()
    for frame, degree in enumerate(sh_degrees):
        splats = make_splats(coefficients=(degree + 1) ** 2)
        (tmp_path / "plys" / f"{frame}.ply").write_bytes(build_ply(splats))
    result = run("import", tmp_path / "plys", "-o", tmp_path / "a.quarc", "-q", "--json")

    assert read_json(result.stdout)["dropped_sh_degree"] == dropped_degree
    assert bool(dropped_degree) == ("SH degrees above 1" in result.stderr)


@pytest.mark.parametrize(
    ("options", "code"),
    [
        (["--bound", "color=1"], 2),
        (["--bound", "median_scale=1"], 2),  # computed from the first frame
        (["--bound", "sh_dc=0"], 2),
        (["--bound", "position=0"], 2),
        (["--bound", "sh_dc=x"], 2),
        (["--fps", "0"], 2),
        (["--bound", "position=1e-9"], 3),
    ],
)
def test_a_failed_import_leaves_nothing(options, code, folder, tmp_path):
    result = run("import", folder, "-o", tmp_path / "a.quarc", *options)

    assert result.exit_code == code
    assert result.stderr
    assert "a.quarc" not in list_names(tmp_path)


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ([], "no .ply or .spz"),
        (["frames.4dgs"], "use the file"),
        (["cam00.mp4", "cam01.mp4"], "is a folder of 2 videos"),
        (["poses_bounds.npy", "cam00.mp4", "points3D_init.ply"], "is a capture (N3DV"),
    ],
)
def test_a_folder_without_frames_of_gaussians_is_a_usage_error(names, message, tmp_path):
    (tmp_path / "in").mkdir()
    for name in names:
        (tmp_path / "in" / name).write_bytes(b"")
    result = run("import", tmp_path / "in", "-o", tmp_path / "a.quarc")

    assert result.exit_code == 2
    assert message in result.stderr


def test_a_broken_ply_has_one_exit_code_in_import_and_compare(stream_file, tmp_path):
    broken_file = tmp_path / "broken.ply"
    broken_file.write_bytes(b"ply")

    assert run("import", broken_file, "-o", tmp_path / "a.quarc").exit_code == 3
    assert run("compare", stream_file, broken_file).exit_code == 3


@pytest.mark.parametrize("axis", ["+y", "y"])
def test_an_axis_can_have_a_plus_sign(axis, folder, tmp_path):
    run("import", folder, "-o", tmp_path / "a.quarc", "--up", axis)

    assert next(decode((tmp_path / "a.quarc").read_bytes())).header.up_axis == 3
    assert run("import", folder, "-o", tmp_path / "b.quarc", "--up", "w").exit_code == 2
