"""Tests that --force deletes only files that the command wrote and listed in a marker."""

import shutil

import pytest

from tests.cli.commands import TINY_OPTIONS, list_names, make_folder, run

_MARKER = ".quarc-ref-made"
_TINY_SYNTH = ["--width", 16, "--height", 16, "--frames", 1]


def _make_user_folder(folder, *names):
    """Make a folder with files of the user, and return the folder."""
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("mine")
    return folder


def _read_all(folder):
    return {path: path.read_text() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    ("verb", "names"),
    [
        ("eval", ["holiday.png", "index.html"]),
        ("demo", ["capture/cam00.mp4", "capture/notes/plan.txt", "report/thesis.tex"]),
        ("synth", ["cam00.mp4", "poses_bounds.npy"]),
        ("decode", ["frame_0000.ply"]),
        ("decode --follow", ["frame_0000.npz"]),
        ("render", ["frame_0000.png"]),
    ],
)
def test_force_deletes_no_file_of_the_user_of_any_name(
    verb, names, stream_file, encoded_stream, capture, tmp_path
):
    user_folder = _make_user_folder(tmp_path / "mine", *names)
    contents_before = _read_all(user_folder)
    lines = {
        "eval": ["eval", encoded_stream.file, capture, "--report", user_folder],
        "demo": ["demo", "-o", user_folder, "--frames", 2, *TINY_OPTIONS],
        "synth": ["synth", user_folder, *_TINY_SYNTH],
        "decode": ["decode", stream_file, "-o", user_folder],
        "decode --follow": ["decode", stream_file, "-o", user_folder, "--follow"],
        "render": ["render", stream_file, "-o", user_folder],
    }
    result = run(*lines[verb], "--force")

    assert _read_all(user_folder) == contents_before
    assert result.exit_code == 2
    assert f"contains {sorted(names)[0].partition('/')[0]}" in result.stderr
    assert "choose another folder" in result.stderr


@pytest.mark.parametrize("verb", ["eval", "compare", "calibrate"])
def test_force_does_not_replace_the_input(verb, encoded_stream, tmp_path):
    capture = tmp_path / "capture"
    run("synth", capture, *_TINY_SYNTH, "--cameras", 3)
    contents_before = {path.name: path.read_bytes() for path in capture.iterdir()}
    file = encoded_stream.file
    lines = {
        "eval": ["eval", file, capture, "--other-capture", "--report", capture],
        "compare": ["compare", file, file, "--capture", capture, "--report", capture],
        "calibrate": ["calibrate", capture, "-o", capture],
    }
    result = run(*lines[verb], "--force")

    assert {path.name: path.read_bytes() for path in capture.iterdir()} == contents_before
    assert result.exit_code == 2
    assert f"{capture} would replace the input {capture}" in result.stderr


@pytest.mark.parametrize("verb", ["decode", "decode --follow", "render"])
def test_force_does_not_replace_a_folder_with_the_stream(verb, stream_file, tmp_path):
    site = tmp_path / "site"
    run("publish", stream_file, "-o", site)
    names = list_names(site)
    result = run(*verb.split(), site / "stream.quarc", "-o", site, "--force")

    assert list_names(site) == names
    assert result.exit_code == 2
    assert f"{site} would replace the input {site / 'stream.quarc'}" in result.stderr


@pytest.mark.parametrize("option", ["--force", "--resume"])
def test_segments_of_the_user_are_not_deleted(option, capture, tmp_path):
    file = tmp_path / "a.quarc"
    user_folder = _make_user_folder(
        tmp_path / "a.quarc.segments", "frames_1999.quarc/diary.txt", "frames_0.quarc"
    )
    contents_before = _read_all(user_folder)
    result = run("encode", capture, "-o", file, *TINY_OPTIONS, "--segments", 2, option)

    assert _read_all(user_folder) == contents_before
    assert result.exit_code == 2
    assert "contains frames_0.quarc" in result.stderr


@pytest.mark.parametrize(
    ("option", "names"),
    [
        ("--live", ["a.quarc", "a.quarc.training"]),
        ("--quiet", ["a.quarc", "a.quarc.part", "a.quarc.part.training"]),
        ("--segments=2", ["a.quarc", "a.quarc.segments/frames_000000_000001.quarc"]),
    ],
)
@pytest.mark.parametrize(
    ("bad_options", "code", "message"),
    [
        (["--held-out=nosuch"], 2, "nosuch"),
        (["--frames=9"], 2, "9 frames"),
        ([f"--held-out=cam0{index}" for index in (0, 1, 3)], 3, "1 training camera"),
    ],
)
def test_force_removes_nothing_before_the_capture_is_checked(
    bad_options, code, message, option, names, capture, tmp_path
):
    for name in names:
        folder, _, file_name = name.rpartition("/")
        if folder:
            make_folder(tmp_path / folder, file_name)
        else:
            (tmp_path / name).write_text("mine")
    contents_before = _read_all(tmp_path)
    result = run("encode", capture, "-o", tmp_path / "a.quarc", "--force", option, *bad_options)

    assert _read_all(tmp_path) == contents_before
    assert result.exit_code == code
    assert message in result.stderr


def test_force_removes_nothing_if_no_frame_is_decoded(stream_file, tmp_path):
    folder = make_folder(tmp_path / "out", "frame_0007.ply")
    contents_before = _read_all(folder)
    runs = [
        run("decode", name, "-o", folder, "--follow", "--patience", "1", "--force", *options)
        for name, options in (("http://127.0.0.1:9/x", []), (stream_file, ["--frames", "900"]))
    ]

    assert _read_all(folder) == contents_before
    assert [result.exit_code for result in runs] == [3, 2]


def test_a_folder_of_the_command_has_a_marker_and_is_replaced(stream_file, tmp_path):
    folder = tmp_path / "out"
    assert run("decode", stream_file, "-o", folder, "--frames", ":2").exit_code == 0
    marker = (folder / _MARKER).read_text()
    assert run("decode", stream_file, "-o", folder, "--frames", "3:", "--force").exit_code == 0

    listed_names = marker.splitlines()[1:]
    assert sorted(listed_names) == ["frame_0000.ply", "frame_0001.ply", "sequence.json"]
    assert list_names(folder) == ["frame_0003.ply"]
    listed_names = (folder / _MARKER).read_text().splitlines()[1:]
    assert sorted(listed_names) == ["frame_0003.ply", "sequence.json"]
    assert list_names(tmp_path) == ["out", "small.quarc"]


def test_a_demo_is_replaced_with_all_its_files(tiny_demo, tmp_path):
    folder = shutil.copytree(tiny_demo.folder, tmp_path / "out")
    command = ["demo", "-o", folder, "--frames", 2, *TINY_OPTIONS]
    (folder / "report" / "mine.txt").write_text("mine")
    rejected_run = run(*command, "--force")
    (folder / "report" / "mine.txt").unlink()
    forced_run = run(*command, "--force")

    assert rejected_run.exit_code == 2
    assert "report contains mine.txt" in rejected_run.stderr
    assert forced_run.exit_code == 0, forced_run.stderr
    assert list_names(folder) == ["capture", "demo.html", "demo.quarc", "report"]
    assert list_names(tmp_path) == ["out"]


@pytest.mark.parametrize(
    "planted_name", ["../victim.txt", "/etc/victim", "..", "sub/victim.txt", "a\\b", "C:victim", ""]
)
def test_a_planted_marker_cannot_lead_outside(planted_name, stream_file, tmp_path):
    user_file = tmp_path / "victim.txt"
    user_file.write_text("mine")
    folder = tmp_path / "out"
    assert run("decode", stream_file, "-o", folder).exit_code == 0
    with (folder / _MARKER).open("a") as marker:
        marker.write(f"{planted_name}\n")
    result = run("decode", stream_file, "-o", folder, "--force")

    assert result.exit_code == 2
    assert _MARKER in result.stderr
    assert user_file.read_text() == "mine"
    assert len(list_names(folder)) == 4


@pytest.mark.parametrize("kind", ["link", "folder"])
def test_a_replacement_of_a_listed_file_is_not_deleted(kind, stream_file, tmp_path):
    user_folder = tmp_path / "victim"
    user_folder.mkdir()
    (user_folder / "a").write_text("mine")
    folder = tmp_path / "out"
    assert run("decode", stream_file, "-o", folder).exit_code == 0
    (folder / "frame_0002.ply").unlink()
    if kind == "link":
        (folder / "frame_0002.ply").symlink_to(user_folder / "a")
    else:
        user_folder.rename(folder / "frame_0002.ply")
    result = run("decode", stream_file, "-o", folder, "--force")

    assert result.exit_code == 2
    assert "contains frame_0002.ply" in result.stderr
    assert "mine" in {path.read_text() for path in tmp_path.rglob("a")}
    assert len(list_names(folder)) == 4
