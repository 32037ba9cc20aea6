import json
from fractions import Fraction

import av
import numpy as np
import pytest

from quarc_ref.datasets.video import VideoReader
from quarc_ref.format import container, wire
from quarc_ref.streams.chunk_reader import split_chunks
from tests.cli.commands import list_names, run, run_json
from tests.cli.schemas import validate
from tests.small_streams import rebuild_stream

_KEPT_KINDS = (container.HEAD, container.CAME, container.CANO, container.FRAM)


def _read_png(path):
    with av.open(str(path)) as opened:
        return next(opened.decode(video=0)).to_ndarray()


@pytest.fixture
def stream(encoded_stream):
    """A stream with three frames and four cameras."""
    return encoded_stream.file


@pytest.mark.parametrize("name", ["orbit", "spiral", "interpolate"])
def test_a_path_has_a_picture_for_each_frame(name, stream, tmp_path):
    json_output = run_json("render", stream, "-o", tmp_path / "o", "--path", name)
    first_picture, last_picture = (
        _read_png(tmp_path / "o" / f"frame_{frame:04}.png") for frame in (0, 2)
    )

    assert json_output["path"] == name
    assert json_output["files"] == [f"frame_{frame:04}.png" for frame in range(3)]
    assert first_picture.shape == (32, 48, 3)
    assert not np.array_equal(first_picture, last_picture)


def test_a_path_keeps_the_up_direction_in_the_metadata_upright(stream, tmp_path):
    chunks = [chunk for chunk in split_chunks(stream.read_bytes()) if chunk.kind in _KEPT_KINDS]
    for name, up in {"a": "0 1 0", "b": "0 -1 0"}.items():
        metadata = container.META, wire.build_metadata({"up": up})
        data = rebuild_stream([*((chunk.kind, chunk.payload) for chunk in chunks), metadata])
        (tmp_path / f"{name}.quarc").write_bytes(data)
        run_json(
            "render", tmp_path / f"{name}.quarc", "-o", tmp_path / name, "--path", "orbit",
            "--frames", "0",
        )  # fmt: skip
    pictures = [_read_png(tmp_path / name / "frame_0000.png") for name in ("a", "b")]

    assert not np.array_equal(*pictures)
    assert np.abs(pictures[0][::-1, ::-1].astype(int) - pictures[1]).mean() < 2


def test_more_pictures_than_frames_are_in_slow_motion(stream, tmp_path):
    run_json("render", stream, "-o", tmp_path / "frames")
    run_json("render", stream, "-o", tmp_path / "slow", "--pictures", 6)
    frames = [_read_png(path) for path in sorted((tmp_path / "frames").glob("*.png"))]
    pictures = [_read_png(path) for path in sorted((tmp_path / "slow").glob("*.png"))]

    assert len(pictures) == 6
    for index, frame in enumerate(frames):
        assert np.array_equal(pictures[2 * index], frame)
    for before, between, after in zip(frames, pictures[1::2], frames[1:], strict=False):
        assert not np.array_equal(between, before)
        assert not np.array_equal(between, after)
    assert np.array_equal(pictures[5], frames[2])


def test_frames_are_spread_over_the_requested_pictures(stream, tmp_path):
    json_output = run_json(
        "render", stream, "-o", tmp_path / "o.mp4", "--path", "orbit", "--pictures", 7,
        "--frames", "1:2",
    )  # fmt: skip

    assert json_output["frames"] == 7
    assert VideoReader(tmp_path / "o.mp4").frame_count == 7


def test_a_path_of_a_camera_shows_the_view_of_that_camera(stream, tmp_path):
    path = tmp_path / "path.json"
    keyframes = [{"time": 0, "camera": "cam03", "frame": 1}]
    path.write_text(json.dumps({"schema": "quarc-ref/camera-path/1", "keyframes": keyframes}))
    run_json("render", stream, "-o", tmp_path / "path", "--path", path, "--camera", "cam01")
    run_json("render", stream, "-o", tmp_path / "cam.png", "--frames", "1", "--camera", "cam03")

    path_picture, camera_picture = (
        _read_png(tmp_path / "path" / "frame_0000.png"),
        _read_png(tmp_path / "cam.png"),
    )
    assert np.abs(path_picture.astype(int) - camera_picture).max() <= 2


def test_a_path_file_may_end_between_two_frames(stream, tmp_path):
    path = tmp_path / "path.json"
    keyframes = [
        {"time": 0, "camera": "cam00", "frame": 0}, {"time": 0.05, "camera": "cam00", "frame": 1}
    ]  # fmt: skip
    path.write_text(json.dumps({"schema": "quarc-ref/camera-path/1", "keyframes": keyframes}))
    json_output = run_json("render", stream, "-o", tmp_path / "o", "--path", path)
    run_json("render", stream, "-o", tmp_path / "frames", "--frames", ":2")

    assert json_output["files"] == ["frame_0000.png", "frame_0001.png"]
    between = _read_png(tmp_path / "o" / "frame_0001.png")
    for name in ("frame_0000.png", "frame_0001.png"):
        assert not np.array_equal(between, _read_png(tmp_path / "frames" / name))


def test_a_webm_video_has_the_frames_of_the_stream(stream, tmp_path):
    json_output = run_json("render", stream, "-o", tmp_path / "a.webm")
    run_json("render", stream, "-o", tmp_path / "a", "--to", "png")

    assert json_output["bytes"] == (tmp_path / "a.webm").stat().st_size
    with av.open(str(tmp_path / "a.webm")) as container:
        video_stream = container.streams.video[0]
        assert video_stream.codec_context.name in ("vp9", "libvpx-vp9")
        assert video_stream.average_rate == Fraction(30)
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(video_stream)]
    assert len(frames) == 3
    png_picture = _read_png(tmp_path / "a" / "frame_0001.png")
    assert np.abs(frames[1].astype(int) - png_picture).mean() < 6


def test_depth_is_the_distance_along_the_axis_in_levels_or_floats(stream, tmp_path):
    json_output = run_json("render", stream, "-o", tmp_path / "levels", "--depth")
    run_json("render", stream, "-o", tmp_path / "floats", "--depth", "--to", "npz")
    sidecar = json.loads((tmp_path / "levels" / "depth.json").read_text())
    validate(sidecar)
    validate(json.loads((tmp_path / "floats" / "depth.json").read_text()))

    assert json_output["files"] == [*(f"depth_{frame:04}.png" for frame in range(3)), "depth.json"]
    assert [entry["frame"] for entry in sidecar["files"]] == [0, 1, 2]
    assert sidecar["files"][0]["camera"]["name"] == "cam00"
    scale = sidecar["files"][1]["scale"]
    with np.load(tmp_path / "floats" / "depth_0001.npz", allow_pickle=False) as arrays:
        depth, opacity = arrays["depth"], arrays["opacity"]
    is_visible = opacity >= 0.5
    decoded_depth = _read_png(tmp_path / "levels" / "depth_0001.png").astype(np.float64) * scale
    assert is_visible.any()
    assert decoded_depth[is_visible] == pytest.approx(depth[is_visible], abs=scale)
    assert (decoded_depth[~is_visible] == 0).all()
    assert 2 < np.median(depth[is_visible]) < 8  # the cameras are four units in front of a plane


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--path", "none.json"], "none.json does not exist"),
        (["--path", "{stream}"], "is not JSON"),
        (["--path", "orbit", "--frames", "9:"], "none of the requested frames"),
        (["--to", "npz"], "--to npz needs --depth"),
        (["--depth", "--to", "webm"], "--depth cannot be combined with --to webm"),
        (["--depth", "--pixels", "yuv444p"], "--pixels is for videos"),
    ],
)
def test_invalid_options_of_paths_and_depth_are_explained(options, message, stream, tmp_path):
    filled_options = [option.format(stream=stream) for option in options]
    result = run("render", stream, "-o", tmp_path / "o", *filled_options)

    assert result.exit_code == 2
    assert message in result.stderr
    assert list_names(tmp_path) == []


@pytest.mark.parametrize(
    "options", [["--path", "orbit"], ["--pictures", "1"], ["--path", "{path}"], ["--frames", "0:9"]]
)
def test_a_stream_that_ends_early_is_rejected(options, stream, tmp_path):
    keyframes = [{"time": 0, "camera": "cam00"}, {"time": 1, "camera": "cam01"}]
    path = tmp_path / "path.json"
    path.write_text(json.dumps({"schema": "quarc-ref/camera-path/1", "keyframes": keyframes}))
    cut_stream = tmp_path / "cut.quarc"
    data = stream.read_bytes()
    last_frame = [chunk for chunk in split_chunks(data) if chunk.kind == container.FRAM][-1]
    cut_stream.write_bytes(data[: data.index(last_frame.payload) + 1])
    filled_options = [option.format(path=path) for option in options]
    result = run("render", cut_stream, "-o", tmp_path / "o", *filled_options)

    assert result.exit_code == 1
    assert "the stream is rejected: truncated" in result.stderr
    assert not (tmp_path / "o").exists()


def test_depth_in_a_file_is_explained(stream, tmp_path):
    result = run("render", stream, "-o", tmp_path / "o.mp4", "--depth")

    assert result.exit_code == 2
    assert "must be a folder for --depth" in result.stderr
    assert "use the suffix .mp4" not in result.stderr


@pytest.mark.parametrize("option", [["--pictures", "7"], ["--fps", "60"]])
def test_an_option_that_a_path_file_excludes_is_named(option, stream, tmp_path):
    path = tmp_path / "path.json"
    keyframes = [{"time": 0, "camera": "cam00"}, {"time": 1, "camera": "cam01"}]
    path.write_text(json.dumps({"schema": "quarc-ref/camera-path/1", "keyframes": keyframes}))
    result = run("render", stream, "-o", tmp_path / "o.mp4", "--path", path, *option)

    assert result.exit_code == 2
    assert option[0] in result.stderr
    assert list_names(tmp_path) == ["path.json"]
