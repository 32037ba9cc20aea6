import av
import numpy as np
import pytest

from quarc_ref.datasets.stills import read_still, read_still_alpha
from quarc_ref.datasets.video import VideoReader
from quarc_ref.evaluation.metrics import measure_psnr
from tests.cli.commands import list_names, read_json, run, run_json
from tests.cli.processes import run_piped
from tests.datasets import scenes


def _measure_mean_psnr(pictures, true_pictures):
    """Return the mean PSNR of 8-bit pictures in dB, computed as in `eval`."""
    pairs = zip(pictures, true_pictures, strict=True)
    return np.mean(
        [
            measure_psnr(picture / np.float32(255), true_picture / np.float32(255))
            for picture, true_picture in pairs
        ]
    )


@pytest.mark.parametrize("kind", ["mp4", "png"])
def test_rendered_pictures_have_the_quality_that_eval_states(
    kind, encoded_stream, capture, tmp_path
):
    """Allow a difference of 0.1 dB, since video codecs lose detail of the noisy pictures."""
    output = tmp_path / ("out.mp4" if kind == "mp4" else "out")
    json_output = run_json("render", encoded_stream.file, "--camera", "cam00", "-o", output)
    if kind == "mp4":
        reader = VideoReader(output)
        pictures = [reader.read(frame) for frame in range(reader.frame_count)]
    else:
        pictures = [read_still(output / name) for name in json_output["files"]]

    true_pictures = scenes.read_video(capture / "cam00.mp4")[: len(pictures)]
    eval_output = run_json("eval", encoded_stream.file, capture)
    assert json_output["frames"] == eval_output["frames"] == len(pictures)
    assert _measure_mean_psnr(pictures, true_pictures) == pytest.approx(
        eval_output["psnr"], abs=0.1
    )


def test_a_range_is_rendered_as_files_with_frame_numbers(stream_file, tmp_path):
    json_output = run_json("render", stream_file, "-o", tmp_path / "out", "--frames", "1:3")

    assert json_output["files"] == ["frame_0001.png", "frame_0002.png"]
    assert list_names(tmp_path / "out") == json_output["files"]
    assert read_still(tmp_path / "out" / "frame_0001.png").shape == (48, 64, 3)


def test_the_height_follows_from_a_given_width(stream_file, tmp_path):
    json_output = run_json("render", stream_file, "-o", tmp_path / "o.mp4", "--width", 32)

    assert (json_output["camera"], json_output["width"], json_output["height"]) == (
        "cam00",
        32,
        24,
    )
    assert VideoReader(tmp_path / "o.mp4").width == 32
    assert json_output["bytes"] == (tmp_path / "o.mp4").stat().st_size


def test_the_kind_of_output_can_be_given(stream_file, tmp_path):
    run_json("render", stream_file, "-o", tmp_path / "film", "--to", "mp4", "--pixels", "yuv420p")

    assert VideoReader(tmp_path / "film").frame_count == 4


@pytest.mark.parametrize(
    ("options", "pixel_format"),
    [
        (["--width", 32], "yuv420p"),
        (["--width", 33], "yuv444p"),
        (["--width", 32, "--pixels", "yuv444p"], "yuv444p"),
    ],
)
def test_colors_are_at_half_resolution_if_options_and_size_allow_it(
    options, pixel_format, stream_file, tmp_path
):
    run_json("render", stream_file, "-o", tmp_path / "o.mp4", *options)

    with av.open(tmp_path / "o.mp4") as container:
        assert container.streams.video[0].pix_fmt == pixel_format


@pytest.mark.parametrize(
    ("options", "count", "rate"),
    [
        (["--fps", 60], 8, 60),
        (["--fps", 15], 2, 15),
        (["--fps", 29.97, "--pictures", 6], 6, 29.97),
        (["--fps", 60, "--frames", "1:3"], 4, 60),
        (["--fps", 1], 1, 1),
        (["--fps", 20], 3, 20),
    ],
)
def test_the_frame_rate_of_a_video_can_be_chosen(options, count, rate, stream_file, tmp_path):
    result = run("render", stream_file, "-o", tmp_path / "v.mp4", *options)  # 4 frames at 30 fps

    assert result.exit_code == 0
    reader = VideoReader(tmp_path / "v.mp4")
    assert (reader.frame_count, reader.frames_per_second) == (count, pytest.approx(rate))


def test_a_transparent_picture_has_alpha(stream_file, tmp_path):
    for color in ("transparent", "#0080FF", "white"):
        result = run("render", stream_file, "-o", tmp_path / f"{color}.png", "--frames", "1",
                     "--background", color)  # fmt: skip
        assert result.exit_code == 0
    alpha = read_still_alpha(tmp_path / "transparent.png")
    assert alpha.min() < alpha.max()
    assert read_still_alpha(tmp_path / "white.png") is None
    blue, white = (read_still(tmp_path / f"{name}.png") for name in ("#0080FF", "white"))
    is_empty = alpha == 0
    assert (white[is_empty] == 255).all()
    assert (blue[is_empty] == (0, 128, 255)).all()


@pytest.mark.parametrize("name", ["film.avi", "v.mov", "out.v1"])
def test_a_name_without_a_known_suffix_writes_nothing(name, stream_file, tmp_path):
    result = run("render", stream_file, "-o", tmp_path / name, "--frames", ":1")

    assert result.exit_code == 2
    assert ".mp4" in result.stderr
    assert "--to" in result.stderr
    assert list_names(tmp_path) == ["small.quarc"]


@pytest.mark.parametrize(
    ("name", "kind"), [("o.webm", "mp4"), ("o.MP4", "webm"), ("o.png", "mp4"), ("o.mp4", "png")]
)
def test_a_suffix_and_a_type_that_differ_write_nothing(name, kind, stream_file, tmp_path):
    result = run("render", stream_file, "-o", tmp_path / name, "--to", kind, "--frames", "0")

    assert result.exit_code == 2
    assert f"conflicts with --to {kind}" in result.stderr
    assert list_names(tmp_path) == ["small.quarc"]


def test_a_folder_can_have_any_suffix_that_is_not_of_a_file(stream_file, tmp_path):
    run_json("render", stream_file, "-o", tmp_path / "out.v1", "--frames", ":1", "--to", "png")

    assert list_names(tmp_path / "out.v1") == ["frame_0000.png"]


@pytest.mark.parametrize(
    ("name", "frames", "message"),
    [
        ("o", ":", "4 PNG files of 64 x 48"),
        ("o", ":1", "1 PNG file of"),
        ("o.MP4", ":", "4 frames of 64 x 48, H.264"),
        ("o.mp4", "0", "1 frame of 64 x 48, H.264"),
    ],
)
def test_the_written_files_are_reported(name, frames, message, stream_file, tmp_path):
    result = run("render", stream_file, "-o", tmp_path / name, "--frames", frames)

    assert result.exit_code == 0
    assert message in result.stdout
    assert "cam00" in result.stdout


def test_a_stream_of_standard_input_is_rendered_too(small_stream, tmp_path):
    completed = run_piped(
        "render", "-", "-o", tmp_path / "o", "--frames", "2:", "--json", data=small_stream.data
    )

    assert completed.returncode == 0, completed.stderr
    assert read_json(completed.stdout)["files"] == ["frame_0002.png", "frame_0003.png"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--camera", "cam07"], "cam00"),
        (["--pixels", "yuv444p"], "--pixels is for videos, not for PNG files"),
        (["--frames", "4:"], "none of the requested frames"),
        (["--to", "mp4", "--pixels", "yuv420p", "--width", "33"], "even"),
        (["--to", "png", "--width", "1000000"], "the limits are 32,767 pixels per side"),
        (["--to", "png", "--width", "16384"], "16384 x 12288 are too large"),
        (["--to", "mp4", "--width", "20000"], "too large for H.264: the limits are 16,384 pixels"),
        (["--to", "mp4", "--width", f"1{'0' * 400}"], "too large"),
        (["--to", "mp4", "--background", "transparent"], "videos cannot be transparent"),
        (["--depth", "--background", "white"], "--depth cannot be combined with --background"),
        (["--background", "mauve"], "not black, white, transparent or a color like #ff8000"),
        (["--background", "#ff800"], "--background is '#ff800'"),
    ],
)
def test_impossible_renders_write_nothing_and_are_explained(
    options, message, stream_file, tmp_path
):
    result = run("render", stream_file, "-o", tmp_path / "out", *options)

    assert result.exit_code == 2
    assert message in result.stderr
    assert list_names(tmp_path) == ["small.quarc"]


def test_a_damaged_stream_leaves_nothing_behind(stream_file, small_stream, tmp_path):
    stream_file.write_bytes(small_stream.data[:-60])

    assert run("render", stream_file, "-o", tmp_path / "a.mp4").exit_code == 1
    assert run("render", stream_file, "-o", tmp_path / "a").exit_code == 1
    assert list_names(tmp_path) == ["small.quarc"]


def test_existing_output_is_replaced_only_with_force(stream_file, tmp_path):
    (tmp_path / "o.mp4").write_text("mine")
    rejected_run = run("render", stream_file, "-o", tmp_path / "o.mp4")
    text_after_rejection = (tmp_path / "o.mp4").read_text()
    forced_run = run("render", stream_file, "-o", tmp_path / "o.mp4", "--force")

    assert (rejected_run.exit_code, text_after_rejection, forced_run.exit_code) == (2, "mine", 0)
    assert VideoReader(tmp_path / "o.mp4").frame_count == 4
